"""TQC of sb3-contrib (torch): the reference that the fast trainer is compared with."""

from pathlib import Path
from typing import Any

import torch
from sb3_contrib import TQC
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.logger import Logger
from stable_baselines3.common.vec_env.base_vec_env import VecEnv

from robojackson.errors import BadConfiguration
from robojackson.rl.config import TqcConfig
from robojackson.rl.randomness import load_random, save_random
from robojackson.rl.replay import buffer_of, load_replay, save_replay
from robojackson.rl.trainer import Layers

FOREVER = 10**12


class PatientTQC(TQC):
    """TQC that does not learn from a nearly empty replay buffer after a resumption."""

    refill = 0

    def train(self, gradient_steps: int, batch_size: int = 64) -> None:
        """A round of updates, unless the buffer has still to be filled."""
        if buffer_of(self).size() * self.n_envs >= self.refill:
            super().train(gradient_steps, batch_size)


class Sb3Trainer:
    """The torch trainer (`Trainer` protocol). It updates the actor with every critic update."""

    def __init__(self, env: VecEnv, config: TqcConfig, seed: int) -> None:
        torch.set_num_threads(1)
        self._refill = min(config.refill, config.buffer)
        self.model = PatientTQC(
            "MlpPolicy",
            env,
            learning_rate=config.learning_rate,
            buffer_size=config.buffer,
            learning_starts=config.warmup,
            batch_size=config.batch,
            tau=config.tau,
            gamma=config.gamma,
            train_freq=config.steps_per_round,
            gradient_steps=config.updates_per_round,
            ent_coef=config.entropy,
            top_quantiles_to_drop_per_net=config.top_quantiles_to_drop,
            policy_kwargs={
                "n_critics": config.critics,
                "n_quantiles": config.quantiles,
                "net_arch": {"pi": list(config.actor), "qf": list(config.critic)},
            },
            seed=seed,
            device="cpu",
        )
        self.model.set_logger(Logger(folder=None, output_formats=[]))

    def learn(self, callback: BaseCallback) -> None:
        self.model.learn(
            FOREVER, callback=callback, log_interval=FOREVER, reset_num_timesteps=False
        )

    def layers(self) -> Layers:
        actor = self.model.actor
        modules = [*actor.latent_pi.children(), actor.mu]
        linear = [m for m in modules if isinstance(m, torch.nn.Linear)]
        return tuple(
            (m.weight.detach().numpy().T.copy(), m.bias.detach().numpy().copy()) for m in linear
        )

    def steps(self) -> int:
        return self.model.num_timesteps

    def updates(self) -> int:
        return self.model._n_updates

    def save(self, folder: Path, with_replay: bool) -> None:
        state = {name: part.state_dict() for name, part in self._parts().items()}
        state |= {"log_ent_coef": self._entropy().detach(), "random": torch.get_rng_state()}
        torch.save(state, folder / "networks.pt")
        save_random(folder / "random.json", {})
        if with_replay:
            save_replay(buffer_of(self.model), folder / "replay.npz")

    def load(self, folder: Path, steps: int, updates: int) -> None:
        state = torch.load(folder / "networks.pt", weights_only=True)
        for name, part in self._parts().items():
            part.load_state_dict(state[name])
        self._entropy().data.copy_(state["log_ent_coef"])
        self.model.num_timesteps, self.model._n_updates = steps, updates
        torch.set_rng_state(state["random"])
        load_random(folder / "random.json", {})
        if (folder / "replay.npz").exists():
            load_replay(buffer_of(self.model), folder / "replay.npz")
        else:
            self.model.refill = self._refill

    def _entropy(self) -> torch.Tensor:
        if self.model.log_ent_coef is None:
            raise BadConfiguration("tqc.entropy must be 'auto' or 'auto_<start>'")
        return self.model.log_ent_coef

    def _parts(self) -> dict[str, Any]:
        return {
            "policy": self.model.policy,
            "actor_optimizer": self.model.actor.optimizer,
            "critic_optimizer": self.model.critic.optimizer,
            "entropy_optimizer": self.model.ent_coef_optimizer,
        }
