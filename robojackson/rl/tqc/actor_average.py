"""The running mean of the actor, which becomes the policy (Polyak averaging).

The actor of the last round is one noisy sample; the mean over the last rounds tracks the reference
more closely at no cost (Polyak & Juditsky, 1992).
"""

from copy import deepcopy
from pathlib import Path

import numpy as np

from robojackson.rl.tqc.trainer import Layers


class ActorAverage:
    """Exponential mean of an actor's layers, a round of updates at a time.

    Args:
        past: Weight of the past a round, 0..1; 0 keeps the newest actor.
    """

    def __init__(self, past: float) -> None:
        self._past, self._count, self._seen = past, 0, 0
        self._mean: Layers = ()

    def add(self, layers: Layers, updates: int) -> None:
        """Add the actor of a round, once; a young mean weighs all rounds equally.

        Args:
            updates: Gradient updates so far, which identify a round.
        """
        if not self._past or updates <= self._seen:
            return
        self._count, self._seen = self._count + 1, updates
        fresh = max(1 - self._past, 1 / self._count)
        if self._count == 1:
            self._mean = deepcopy(layers)
            return
        for old, new in zip(self._mean, layers, strict=True):
            for kept, array in zip(old, new, strict=True):
                kept += np.float32(fresh) * (array - kept)

    def layers(self, newest: Layers, updates: int) -> Layers:
        """Return the mean including the newest actor, without changing the stored mean."""
        whole = deepcopy(self)
        whole.add(newest, updates)
        return whole._mean if whole._count else newest

    def save(self, folder: Path) -> None:
        """Write the mean into a checkpoint."""
        arrays = {
            f"{i}{k}": a
            for i, pair in enumerate(self._mean)
            for k, a in zip("wb", pair, strict=True)
        }
        counts = {"count": np.array(self._count), "seen": np.array(self._seen)}
        np.savez(folder / "average.npz", **counts, **arrays)  # type: ignore[arg-type]

    def load(self, folder: Path) -> None:
        """Read the mean from a checkpoint."""
        with np.load(folder / "average.npz", allow_pickle=False) as arrays:
            self._count = int(arrays["count"])
            self._seen = int(arrays["seen"])
            pairs = len(arrays.files) // 2 - 1
            self._mean = tuple((arrays[f"{i}w"], arrays[f"{i}b"]) for i in range(pairs))
