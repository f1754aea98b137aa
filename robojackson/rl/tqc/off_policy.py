"""Common parts of both trainers: the arguments of TQC, the loop, counters, replay and
randomness."""

from pathlib import Path
from typing import Any

import numpy as np
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.logger import Logger
from stable_baselines3.common.off_policy_algorithm import OffPolicyAlgorithm
from stable_baselines3.common.vec_env.base_vec_env import VecEnv

from robojackson.rl.config.train_config import TqcConfig
from robojackson.rl.tqc.random_state import load_random, save_random
from robojackson.rl.tqc.replay_files import ReplayFiles, buffer_of

FOREVER = 10**12
OBSERVATION = "observation.npy"
"""The last observation in a checkpoint; missing in one from before the first step."""


def arguments(config: TqcConfig, seed: int, env: VecEnv) -> dict[str, Any]:
    """Return our configuration as arguments of Stable-Baselines3, for either TQC."""
    return {
        "policy": "MlpPolicy",
        "learning_rate": config.learning_rate,
        "buffer_size": config.buffer,
        "learning_starts": config.warmup,
        "batch_size": config.batch,
        "tau": config.tau,
        "gamma": config.gamma,
        "n_steps": config.n_steps,
        "train_freq": config.steps_per_round,
        "gradient_steps": config.updates_per_round,
        "ent_coef": config.entropy,
        "target_entropy": -config.target_entropy * float(np.prod(env.action_space.shape or 1)),
        "top_quantiles_to_drop_per_net": config.top_quantiles_to_drop,
        "policy_kwargs": {
            "n_critics": config.critics,
            "n_quantiles": config.quantiles,
            "log_std_init": config.actor_start.log_std_init,
            "net_arch": {"pi": list(config.actor), "qf": list(config.critic)},
        },
        "seed": seed,
    }


def is_warming_up(model: OffPolicyAlgorithm, warmup: int) -> bool:
    """Return whether the replay buffer holds too little to learn from."""
    return buffer_of(model).size() * model.n_envs < warmup


class OffPolicyTrainer:
    """The part of the `Trainer` protocol that does not depend on how networks are computed.

    The model has an attribute `warmup`: number of transitions before it learns.
    """

    model: Any

    def __init__(self, model: Any, generators: dict[str, np.random.Generator]) -> None:
        self.model = model
        self._generators = generators | {"warmup": model.action_space.np_random}
        self._files: ReplayFiles | None = None
        model.set_logger(Logger(folder=None, output_formats=[]))

    def learn(self, callback: BaseCallback) -> None:
        """Learn until the callback stops it."""
        self.model.learn(
            FOREVER, callback=callback, log_interval=FOREVER, reset_num_timesteps=False
        )

    def steps(self) -> int:
        """Return the control steps so far."""
        result: int = self.model.num_timesteps
        return result

    def updates(self) -> int:
        """Return the gradient updates so far."""
        result: int = self.model._n_updates
        return result

    def saved(self) -> None:
        """Remove replay files that are no longer needed."""
        assert self._files is not None
        self._files.prune(buffer_of(self.model), self._rows())

    def _act_at_once(self) -> None:
        """Use no random actions: the loaded policy fills the replay buffer."""
        self.model.learning_starts = 0

    def _rows(self) -> int:
        result: int = self.model.num_timesteps // self.model.n_envs
        return result

    def _save_rest(self, folder: Path, replay: Path) -> None:
        save_random(folder / "random.json", self._generators)
        if self.model._last_obs is not None:
            np.save(folder / OBSERVATION, self.model._last_obs)
        self._files = self._files or ReplayFiles(replay)
        self._files.save(buffer_of(self.model), self._rows())

    def _load_rest(self, folder: Path, replay: Path, steps: int, updates: int) -> None:
        self.model.num_timesteps, self.model._n_updates = steps, updates
        load_random(folder / "random.json", self._generators)
        if (folder / OBSERVATION).is_file():
            self.model._last_obs = np.load(folder / OBSERVATION, allow_pickle=False)
        self.model._last_episode_starts = np.zeros(self.model.n_envs, bool)
        self._files = ReplayFiles(replay)
        self._files.load(buffer_of(self.model), self._rows())
