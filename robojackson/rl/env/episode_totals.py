"""Running totals of the episodes of N environments, and one summary row when an episode ends."""

import numpy as np
from jaxtyping import Float, Int


class EpisodeTotals:
    """Return, reward terms and site error of the current episode of each environment."""

    def __init__(self, n: int, dt: float) -> None:
        self._n, self._dt = n, dt
        self._sums: dict[str, Float[np.ndarray, " N"]] = {}
        self._means: tuple[str, ...] = ()

    def add(
        self,
        reward: Float[np.ndarray, " N"],
        terms: dict[str, Float[np.ndarray, " N"]],
        errors: dict[str, Float[np.ndarray, " N"]],
    ) -> None:
        """Add one step of every environment; errors are averaged, the others are summed."""
        self._means = tuple(errors)
        rows = {"episode_return": reward, **errors}
        rows |= {f"reward_{name}": value for name, value in terms.items()}
        for name, value in rows.items():
            if name not in self._sums:
                self._sums[name] = np.zeros(self._n)
            self._sums[name] += value

    def close(
        self, done: Int[np.ndarray, " I"], age: Int[np.ndarray, " N"], repeats: int = 1
    ) -> list[dict[str, float]]:
        """Return rows of the episodes that ended after `age` control steps; reset their totals."""
        rows = []
        for i in done:
            row = {name: float(total[i]) for name, total in self._sums.items()}
            actions = int(age[i]) // repeats
            row |= {name: row[name] / actions for name in self._means}
            rows.append(row | {"episode_length": actions, "survived_s": int(age[i]) * self._dt})
        self.clear(done)
        return rows

    def clear(self, which: Int[np.ndarray, " I"]) -> None:
        """Reset the running totals of some environments."""
        for total in self._sums.values():
            total[which] = 0.0

    def state(self) -> dict[str, np.ndarray]:
        """Return the running totals as arrays."""
        return {f"sum_{name}": total.copy() for name, total in self._sums.items()}

    def restore(self, state: dict[str, np.ndarray]) -> None:
        """Restore the totals from `state`."""
        for name, total in state.items():
            if name.startswith("sum_"):
                self._sums[name.removeprefix("sum_")] = np.array(total)
