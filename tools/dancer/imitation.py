"""The dancer's network as it learns from lessons: supervised, with mirror images.

Layers as in `rl.policy`: ReLU between them, tanh at the end; observations are not normalised.
"""

from itertools import pairwise

import numpy as np
import torch
from jaxtyping import Float
from torch import nn

from tools.dancer.mirror import ObservationMirror
from tools.dancer.rehearsal import ACTION_FACTOR, Lessons

BATCH = 1024


class Memory:
    """All lessons so far, in arrays that grow to a fixed size."""

    def __init__(self, rows: int, size: int, motors: int) -> None:
        self.seen = np.zeros((rows, size), np.float16)
        self.advice = np.zeros((rows, motors), np.float16)
        self.count = 0

    def add(self, lessons: Lessons, rng: np.random.Generator) -> None:
        """Add lessons; once full, they replace random ones."""
        new, room = len(lessons.seen), len(self.seen) - self.count
        rows = np.arange(self.count, self.count + min(new, room))
        self.count += len(rows)
        if len(rows) < new:
            rows = np.concatenate([rows, rng.integers(0, len(self.seen), new - len(rows))])
        self.seen[rows], self.advice[rows] = lessons.seen, lessons.advice


class Student:
    """The dancer's network and its optimiser."""

    def __init__(
        self, size: int, motors: int, hidden: tuple[int, ...], mirror: ObservationMirror, seed: int
    ) -> None:
        torch.manual_seed(seed)
        widths = (size, *hidden, motors)
        layers: list[nn.Module] = []
        for wide, narrow in pairwise(widths):
            layers += [nn.Linear(wide, narrow), nn.ReLU()]
        self._net = nn.Sequential(*layers[:-1], nn.Tanh())
        self._optimiser = torch.optim.Adam(self._net.parameters(), lr=1e-3)
        self._mirror = mirror

    def act(self, seen: Float[np.ndarray, "N D"]) -> Float[np.ndarray, "N nu"]:
        """Return the actions, -1..1."""
        with torch.no_grad():
            result: np.ndarray = self._net(torch.from_numpy(np.asarray(seen, np.float32))).numpy()
        return result

    def learn(self, memory: Memory, updates: int, rate: float, rng: np.random.Generator) -> float:
        """Take steps of Adam on random lessons, half of them in the mirror; return the mean loss:
        Huber's, of full actions of the robot."""
        for group in self._optimiser.param_groups:
            group["lr"] = rate
        total = 0.0
        for _ in range(updates):
            rows = rng.integers(0, memory.count, BATCH)
            seen, advice = (a[rows].astype(np.float32) for a in (memory.seen, memory.advice))
            half = BATCH // 2
            seen[:half] = self._mirror.observation(seen[:half])
            advice[:half] = self._mirror.action(advice[:half])
            own = self._net(torch.from_numpy(seen))
            loss = nn.functional.huber_loss(
                ACTION_FACTOR * own, ACTION_FACTOR * torch.from_numpy(advice)
            )
            self._optimiser.zero_grad()
            loss.backward()  # type: ignore[no-untyped-call]
            self._optimiser.step()
            total += float(loss.detach())
        return total / max(1, updates)

    def layers(self) -> tuple[tuple[np.ndarray, np.ndarray], ...]:
        """Return (weight (in, out), bias) of every layer."""
        linear = [layer for layer in self._net if isinstance(layer, nn.Linear)]
        return tuple(
            (one.weight.detach().numpy().T.copy(), one.bias.detach().numpy().copy())
            for one in linear
        )

    def state(self) -> dict[str, object]:
        """Return what a resumed training needs."""
        return {"net": self._net.state_dict(), "optimiser": self._optimiser.state_dict()}

    def restore(self, state: dict[str, dict[str, object]]) -> None:
        """Restore the student from `state`."""
        self._net.load_state_dict(state["net"])
        self._optimiser.load_state_dict(state["optimiser"])
