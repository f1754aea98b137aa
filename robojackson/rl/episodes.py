"""Running totals of the episodes of N environments, and one summary row when an episode ends."""

import numpy as np
from jaxtyping import Float, Int


class EpisodeTotals:
    """Return, reward terms and site error of the current episode of each environment."""

    def __init__(self, n: int, dt: float) -> None:
        self._n, self._dt = n, dt
        self._sums: dict[str, Float[np.ndarray, " N"]] = {}

    def add(
        self,
        reward: Float[np.ndarray, " N"],
        terms: dict[str, Float[np.ndarray, " N"]],
        site_error: Float[np.ndarray, " N"],
    ) -> None:
        """Count one step of every environment."""
        rows = {"episode_return": reward, "site_error_m": site_error}
        rows |= {f"reward_{name}": value for name, value in terms.items()}
        for name, value in rows.items():
            self._sums.setdefault(name, np.zeros(self._n))
            self._sums[name] += value

    def close(
        self, done: Int[np.ndarray, " I"], age: Int[np.ndarray, " N"]
    ) -> list[dict[str, float]]:
        """Rows of the episodes that ended after `age` steps; their totals start anew."""
        rows = []
        for i in done:
            row = {name: float(total[i]) for name, total in self._sums.items()}
            steps = int(age[i])
            row["site_error_m"] /= steps
            rows.append(row | {"episode_length": steps, "survived_s": steps * self._dt})
        self.clear(done)
        return rows

    def clear(self, which: Int[np.ndarray, " I"]) -> None:
        """Forget the running totals of some environments."""
        for total in self._sums.values():
            total[which] = 0.0
