"""The replay buffer of Stable-Baselines3 on disk: every transition is written once.

A checkpoint adds one file with the transitions since the last one, so its cost depends on the new
transitions alone. A crash during the write leaves the files of the previous checkpoint unchanged;
files that the buffer has overwritten are removed after the next checkpoint. Nothing is pickled.
"""

import os
from pathlib import Path

import numpy as np
from stable_baselines3.common.buffers import ReplayBuffer
from stable_baselines3.common.off_policy_algorithm import OffPolicyAlgorithm

ARRAYS = ("observations", "next_observations", "actions", "rewards", "dones", "timeouts")


def buffer_of(model: OffPolicyAlgorithm) -> ReplayBuffer:
    """Return the replay buffer of an algorithm that has been set up."""
    if model.replay_buffer is None:
        raise RuntimeError("the algorithm has no replay buffer yet")
    return model.replay_buffer


class ReplayFiles:
    """The files of one run; a row is one step of all its simulations."""

    def __init__(self, folder: Path) -> None:
        self._folder, self._kept = folder, 0

    def save(self, buffer: ReplayBuffer, rows: int) -> None:
        """Write the rows since the last call; `rows` is the total number of rows added to the
        buffer."""
        first = max(self._kept, rows - buffer.buffer_size)
        if first < rows:
            self._folder.mkdir(exist_ok=True)
            slots = np.arange(first, rows) % buffer.buffer_size
            part = self._folder / "new.part"
            with part.open("wb") as file:
                np.savez(file, **{name: getattr(buffer, name)[slots] for name in ARRAYS})
                file.flush()
                os.fsync(file.fileno())
            os.replace(part, self._folder / f"{first:012d}-{rows:012d}.npz")
        self._kept = rows

    def load(self, buffer: ReplayBuffer, rows: int) -> None:
        """Restore the buffer to its state after `rows` rows; remove later files."""
        for path, first, last in self._files():
            if last > rows:
                path.unlink()
                continue
            slots = np.arange(first, last) % buffer.buffer_size
            with np.load(path, allow_pickle=False) as arrays:
                for name in ARRAYS:
                    getattr(buffer, name)[slots] = arrays[name]
        buffer.pos, buffer.full = rows % buffer.buffer_size, rows >= buffer.buffer_size
        self._kept = rows

    def prune(self, buffer: ReplayBuffer, rows: int) -> None:
        """Remove the files whose rows the buffer has overwritten."""
        for path, _, last in self._files():
            if last <= rows - buffer.buffer_size:
                path.unlink()

    def _files(self) -> list[tuple[Path, int, int]]:
        found = sorted(self._folder.glob("*-*.npz"))
        return [(path, *map(int, path.stem.split("-"))) for path in found]  # type: ignore[misc]
