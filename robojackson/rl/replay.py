"""The replay buffer of Stable-Baselines3 as plain arrays on disk (nothing is pickled)."""

from pathlib import Path

import numpy as np
from stable_baselines3.common.buffers import ReplayBuffer
from stable_baselines3.common.off_policy_algorithm import OffPolicyAlgorithm

ARRAYS = ("observations", "next_observations", "actions", "rewards", "dones", "timeouts")


def buffer_of(model: OffPolicyAlgorithm) -> ReplayBuffer:
    """The replay buffer of an algorithm that has been set up."""
    if model.replay_buffer is None:
        raise RuntimeError("the algorithm has no replay buffer yet")
    return model.replay_buffer


def save_replay(buffer: ReplayBuffer, path: Path) -> None:
    """Write the filled part of a replay buffer."""
    count = buffer.buffer_size if buffer.full else buffer.pos
    arrays = {name: getattr(buffer, name)[:count] for name in ARRAYS}
    with path.open("wb") as file:
        np.savez(file, pos=buffer.pos, full=buffer.full, **arrays)


def load_replay(buffer: ReplayBuffer, path: Path) -> None:
    """Fill a replay buffer from what `save_replay` wrote."""
    with np.load(path, allow_pickle=False) as arrays:
        for name in ARRAYS:
            getattr(buffer, name)[: len(arrays[name])] = arrays[name]
        buffer.pos, buffer.full = int(arrays["pos"]), bool(arrays["full"])
