"""TQC of sb3-contrib (torch): the reference that the fast trainer is compared with."""

from pathlib import Path
from typing import Any

import torch
from sb3_contrib import TQC
from stable_baselines3.common.vec_env.base_vec_env import VecEnv

from robojackson.rl.config import TqcConfig
from robojackson.rl.off_policy import OffPolicyTrainer, arguments, filled
from robojackson.rl.trainer import Layers


class PatientTQC(TQC):
    """TQC that does not learn from a nearly empty replay buffer after a resumption."""

    refill = 0

    def train(self, gradient_steps: int, batch_size: int = 64) -> None:
        """A round of updates, unless the buffer has still to be filled."""
        if filled(self, self.refill):
            super().train(gradient_steps, batch_size)


class Sb3Trainer(OffPolicyTrainer):
    """The torch trainer (`Trainer` protocol). It updates the actor with every critic update."""

    def __init__(self, env: VecEnv, config: TqcConfig, seed: int) -> None:
        torch.set_num_threads(1)
        super().__init__(
            PatientTQC(env=env, device="cpu", **arguments(config, seed)), config, generators={}
        )

    def layers(self) -> Layers:
        actor = self.model.actor
        modules = [*actor.latent_pi.children(), actor.mu]
        linear = [m for m in modules if isinstance(m, torch.nn.Linear)]
        return tuple(
            (m.weight.detach().numpy().T.copy(), m.bias.detach().numpy().copy()) for m in linear
        )

    def save(self, folder: Path, with_replay: bool) -> None:
        state = {name: part.state_dict() for name, part in self._parts().items()}
        state |= {"log_ent_coef": self.model.log_ent_coef.detach(), "random": torch.get_rng_state()}
        torch.save(state, folder / "networks.pt")
        self._save_rest(folder, with_replay)

    def load(self, folder: Path, steps: int, updates: int) -> None:
        state = torch.load(folder / "networks.pt", weights_only=True)
        for name, part in self._parts().items():
            part.load_state_dict(state[name])
        self.model.log_ent_coef.data.copy_(state["log_ent_coef"])
        torch.set_rng_state(state["random"])
        self._load_rest(folder, steps, updates)

    def _parts(self) -> dict[str, Any]:
        return {
            "policy": self.model.policy,
            "actor_optimizer": self.model.actor.optimizer,
            "critic_optimizer": self.model.critic.optimizer,
            "entropy_optimizer": self.model.ent_coef_optimizer,
        }
