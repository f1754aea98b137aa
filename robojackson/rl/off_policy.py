"""What both trainers share: the arguments of TQC, the loop, the counters, replay and randomness."""

from pathlib import Path
from typing import Any

import numpy as np
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.logger import Logger
from stable_baselines3.common.off_policy_algorithm import OffPolicyAlgorithm

from robojackson.rl.config import TqcConfig
from robojackson.rl.randomness import load_random, save_random
from robojackson.rl.replay import buffer_of, load_replay, save_replay

FOREVER = 10**12


def arguments(config: TqcConfig, seed: int) -> dict[str, Any]:
    """Our configuration in the words of Stable-Baselines3, for either TQC."""
    return {
        "policy": "MlpPolicy",
        "learning_rate": config.learning_rate,
        "buffer_size": config.buffer,
        "learning_starts": config.warmup,
        "batch_size": config.batch,
        "tau": config.tau,
        "gamma": config.gamma,
        "train_freq": config.steps_per_round,
        "gradient_steps": config.updates_per_round,
        "ent_coef": config.entropy,
        "top_quantiles_to_drop_per_net": config.top_quantiles_to_drop,
        "policy_kwargs": {
            "n_critics": config.critics,
            "n_quantiles": config.quantiles,
            "net_arch": {"pi": list(config.actor), "qf": list(config.critic)},
        },
        "seed": seed,
    }


def filled(model: OffPolicyAlgorithm, refill: int) -> bool:
    """Whether the replay buffer holds enough to learn from after a resumption."""
    return buffer_of(model).size() * model.n_envs >= refill


class OffPolicyTrainer:
    """The part of the `Trainer` protocol that does not depend on how networks are computed.

    The model has an attribute `refill`: transitions that it waits for before it learns.
    """

    model: Any

    def __init__(
        self, model: Any, config: TqcConfig, generators: dict[str, np.random.Generator]
    ) -> None:
        self.model = model
        self._refill = min(config.refill, config.buffer)
        self._generators = generators
        model.set_logger(Logger(folder=None, output_formats=[]))

    def learn(self, callback: BaseCallback) -> None:
        self.model.learn(
            FOREVER, callback=callback, log_interval=FOREVER, reset_num_timesteps=False
        )

    def steps(self) -> int:
        return self.model.num_timesteps

    def updates(self) -> int:
        return self.model._n_updates

    def _save_rest(self, folder: Path, with_replay: bool) -> None:
        save_random(folder / "random.json", self._generators)
        if with_replay:
            save_replay(buffer_of(self.model), folder / "replay.npz")

    def _load_rest(self, folder: Path, steps: int, updates: int) -> None:
        self.model.num_timesteps, self.model._n_updates = steps, updates
        load_random(folder / "random.json", self._generators)
        if (folder / "replay.npz").exists():
            load_replay(buffer_of(self.model), folder / "replay.npz")
        else:
            self.model.refill = self._refill
