"""TQC of sb3-contrib (torch): the reference implementation of the fast trainer."""

import io
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import torch
from sb3_contrib import TQC
from sb3_contrib.tqc.policies import Actor, Critic, TQCPolicy
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor
from stable_baselines3.common.type_aliases import RolloutReturn
from stable_baselines3.common.vec_env.base_vec_env import VecEnv

from robojackson.rl.config.tqc_config import NORM_EPSILON
from robojackson.rl.config.train_config import TqcConfig
from robojackson.rl.tqc.network_arrays import CRITICS, TARGETS, Tensors
from robojackson.rl.tqc.off_policy import OffPolicyTrainer, arguments, is_warming_up
from robojackson.rl.tqc.trainer import Layers, of_seen


class NormalisedCritic(Critic):
    """TQC's critics with layer normalisation after every hidden layer."""

    def __init__(self, *args: Any, **named: Any) -> None:
        super().__init__(*args, **named)
        for i, plain in enumerate(self.q_networks):
            *hidden, last = plain
            normalised: list[torch.nn.Module] = []
            for layer in hidden:
                normalised.append(layer)
                if isinstance(layer, torch.nn.Linear):
                    norm = torch.nn.LayerNorm(layer.out_features, eps=NORM_EPSILON)
                    normalised.append(norm)
            self.q_networks[i] = torch.nn.Sequential(*normalised, last)
            self.add_module(f"qf{i}", self.q_networks[i])


class OnboardPolicy(TQCPolicy):
    """TQC's policy whose actor sees the beginning of an observation alone."""

    seen: int | None = None

    def make_actor(self, features_extractor: Any = None) -> Actor:
        """Create the actor; its unseen inputs are zero."""
        actor = super().make_actor(features_extractor)
        if self.seen is not None:
            actor.features_extractor = Beginning(self.observation_space, self.seen)
        return actor


class NormalisedPolicy(OnboardPolicy):
    """TQC's policy with normalised critics."""

    def make_critic(self, features_extractor: Any = None) -> Critic:
        """Create critics, or their targets."""
        given = self._update_features_extractor(self.critic_kwargs, features_extractor)
        return NormalisedCritic(**given).to(self.device)


class Beginning(BaseFeaturesExtractor):
    """Observations with zeros after the first inputs."""

    def __init__(self, space: gymnasium.Space[Any], seen: int) -> None:
        size = int(np.prod(space.shape or 1))
        super().__init__(space, size)
        self._seen = torch.arange(size) < seen

    def forward(self, observations: torch.Tensor) -> torch.Tensor:
        """Return the observation with zeros."""
        return torch.where(self._seen, observations, 0.0)


class WarmupTQC(TQC):
    """TQC that does not learn from a nearly empty replay buffer.

    Attributes:
        random: State of torch's generator between two rounds, before gSDE draws for the next one.
    """

    warmup = 0
    random: torch.Tensor | None = None

    def collect_rollouts(self, *args: Any, **named: Any) -> RolloutReturn:
        """Collect a round of steps."""
        self.random = torch.get_rng_state()
        return super().collect_rollouts(*args, **named)

    def train(self, gradient_steps: int, batch_size: int = 64) -> None:
        """Run a round of updates, unless the buffer is still being filled."""
        if not is_warming_up(self, self.warmup):
            super().train(gradient_steps, batch_size)


class Sb3Trainer(OffPolicyTrainer):
    """The torch trainer (`Trainer` protocol). It updates the actor with every critic update."""

    def __init__(self, env: VecEnv, config: TqcConfig, seed: int, seen: int | None = None) -> None:
        torch.set_num_threads(1)
        given = arguments(config, seed, env)
        if config.gsde:
            given["use_sde"] = True
            given["policy_kwargs"] |= {"clip_mean": 0.0}  # a policy file has no clipped mean
        kind = NormalisedPolicy if config.layer_norm else OnboardPolicy
        given["policy"] = type(kind.__name__, (kind,), {"seen": seen})
        model = WarmupTQC(env=env, device="cpu", **given)
        model.warmup, self._seen = config.warmup, seen
        super().__init__(model, generators={})

    def layers(self) -> Layers:
        """Return the actor's layers."""
        actor = self.model.actor
        modules = [*actor.latent_pi.children(), actor.mu]
        linear = [m for m in modules if isinstance(m, torch.nn.Linear)]
        layers = tuple(
            (m.weight.detach().numpy().T.copy(), m.bias.detach().numpy().copy()) for m in linear
        )
        return of_seen(layers, self._seen)

    def acting(self) -> tuple[Layers, int]:
        """Return the acting actor's layers and its gradient updates."""
        return self.layers(), self.updates()

    def networks(self) -> Tensors:
        """Return actor and critics by name."""
        tensors: Tensors = {}
        for name, parameter in self._named().items():
            tensors[name] = parameter.detach().numpy().T.copy()
        return tensors | {"log_alpha": self.model.log_ent_coef.detach().numpy().reshape(()).copy()}

    def start_from(self, tensors: Mapping[str, np.ndarray]) -> None:
        """Load named arrays into the networks."""
        with torch.no_grad():
            for name, parameter in self._named().items():
                if name in tensors:
                    parameter.copy_(torch.from_numpy(np.array(tensors[name].T)))
            if "log_alpha" in tensors:
                self.model.log_ent_coef.fill_(float(np.reshape(tensors["log_alpha"], ())))
        self._act_at_once()

    def save(self, folder: Path, replay: Path) -> None:
        """Write networks, optimizers, random state and new transitions."""
        state = {name: part.state_dict() for name, part in self._parts().items()}
        random = torch.get_rng_state() if self.model.random is None else self.model.random
        state |= {"log_ent_coef": self.model.log_ent_coef.detach(), "random": random}
        content = io.BytesIO()  # torch's own writer hides that a disk is full
        torch.save(state, content)
        (folder / "networks.pt").write_bytes(content.getvalue())
        self._save_rest(folder, replay)

    def load(self, folder: Path, replay: Path, steps: int, updates: int) -> None:
        """Continue from what `save` wrote."""
        state = torch.load(folder / "networks.pt", weights_only=True)
        for name, part in self._parts().items():
            part.load_state_dict(state[name])
        self.model.log_ent_coef.data.copy_(state["log_ent_coef"])
        torch.set_rng_state(state["random"])
        self._load_rest(folder, replay, steps, updates)

    def _named(self) -> dict[str, torch.Tensor]:
        """Return the parameters by our names; matrices are transposed there."""
        policy = self.model.policy
        chains = {"actor": policy.actor.latent_pi}
        chains |= {c: policy.critic.q_networks[i] for i, c in enumerate(CRITICS)}
        chains |= {t: policy.critic_target.q_networks[i] for i, t in enumerate(TARGETS)}
        heads = {"mean": policy.actor.mu, "log_std": policy.actor.log_std}
        layers = {n: m for n, m in heads.items() if isinstance(m, torch.nn.Linear)}
        norms: dict[str, Any] = {}
        for name, chain in chains.items():
            layers |= _numbered(f"{name}.", chain, torch.nn.Linear)
            norms |= _numbered(f"{name}.norm.", chain, torch.nn.LayerNorm)
        named = {f"{name}.weight": layer.weight for name, layer in layers.items()}
        named |= {f"{name}.bias": layer.bias for name, layer in layers.items()}
        named |= {f"{name}.scale": layer.weight for name, layer in norms.items()}
        return named | {f"{name}.offset": layer.bias for name, layer in norms.items()}

    def _parts(self) -> dict[str, Any]:
        return {
            "policy": self.model.policy,
            "actor_optimizer": self.model.actor.optimizer,
            "critic_optimizer": self.model.critic.optimizer,
            "entropy_optimizer": self.model.ent_coef_optimizer,
        }


def _numbered(prefix: str, chain: torch.nn.Module, kind: type[Any]) -> dict[str, Any]:
    """Return the layers of a kind in the order of the forward pass."""
    found = [module for module in chain.modules() if isinstance(module, kind)]
    return {f"{prefix}{i}": module for i, module in enumerate(found)}
