"""TQC in JAX (SBX), with learning and acting at the same time.

SBX dispatches a round of updates to XLA, which computes in its own thread; meanwhile the
simulations step with the actor of the round before, as numpy arrays. Acting lags by one round and
the result is still determined by the seed.
"""

import os

os.environ.setdefault("JAX_PLATFORMS", "cpu")
os.environ.setdefault(
    "XLA_FLAGS", "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1"
)

from pathlib import Path
from typing import Any

import flax.serialization
import jax
import numpy as np
from sbx import TQC
from sbx.common.type_aliases import ReplayBufferSamplesNp
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.vec_env.base_vec_env import VecEnv

from robojackson.rl.config import TqcConfig
from robojackson.rl.off_policy import OffPolicyTrainer, arguments, filled
from robojackson.rl.replay import buffer_of
from robojackson.rl.trainer import Layers

LOG_STD_RANGE = (-20.0, 2.0)


class OverlappedTQC(TQC):
    """TQC whose updates run while the environments step."""

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self.refill = 0
        self.noise = np.random.default_rng(self.seed)
        self._acting = actor_layers(self.policy.actor_state.params)

    def predict(  # type: ignore[override]
        self,
        observation: np.ndarray,
        state: Any = None,
        episode_start: Any = None,
        deterministic: bool = False,
    ) -> tuple[np.ndarray, Any]:
        """Sample actions from the actor of the round before."""
        hidden = observation
        for weight, bias in self._acting[:-2]:
            hidden = np.maximum(hidden @ weight + bias, 0.0)
        (mean_w, mean_b), (std_w, std_b) = self._acting[-2:]
        mean = hidden @ mean_w + mean_b
        if not deterministic:
            log_std = np.clip(hidden @ std_w + std_b, *LOG_STD_RANGE)
            noise = self.noise.standard_normal(mean.shape, np.float32)
            mean = mean + np.exp(log_std) * noise
        return np.tanh(mean), state

    def train(self, gradient_steps: int, batch_size: int) -> None:
        """Wait for the round before, take its actor, and dispatch the next round."""
        if not filled(self, self.refill):
            return
        self._acting = actor_layers(self.policy.actor_state.params)
        samples = buffer_of(self).sample(batch_size * gradient_steps)
        data = ReplayBufferSamplesNp(
            samples.observations.numpy(),
            samples.actions.numpy(),
            samples.next_observations.numpy(),
            samples.dones.numpy().flatten(),
            samples.rewards.numpy().flatten(),
            np.full(batch_size * gradient_steps, self.gamma, np.float32),
        )
        policy = self.policy
        policy.qf1_state, policy.qf2_state, policy.actor_state, self.ent_coef_state, self.key, _ = (
            self._train(
                self.tau,
                self.target_entropy,
                gradient_steps,
                policy.n_target_quantiles,
                data,
                self.policy_delay,
                (self._n_updates + 1) % self.policy_delay,
                policy.qf1_state,
                policy.qf2_state,
                policy.actor_state,
                self.ent_coef_state,
                self.key,
            )
        )
        self._n_updates += gradient_steps


def actor_layers(params: Any) -> Layers:
    """The actor's dense layers as numpy arrays: hidden ones, then mean, then log std."""
    tree = jax.device_get(params)["params"]
    names = sorted(tree, key=lambda name: int(name.rsplit("_", 1)[1]))
    return tuple((np.asarray(tree[n]["kernel"]), np.asarray(tree[n]["bias"])) for n in names)


class SbxTrainer(OffPolicyTrainer):
    """The JAX trainer (`Trainer` protocol)."""

    def __init__(self, env: VecEnv, config: TqcConfig, seed: int) -> None:
        model = OverlappedTQC(env=env, policy_delay=config.policy_delay, **arguments(config, seed))
        super().__init__(model, config, {"noise": model.noise})

    def learn(self, callback: BaseCallback) -> None:
        try:
            super().learn(callback)
        finally:  # a round that XLA still computes when Python ends would crash it
            jax.block_until_ready(self._state())

    def layers(self) -> Layers:
        layers = actor_layers(self.model.policy.actor_state.params)
        return layers[:-1]

    def save(self, folder: Path, with_replay: bool) -> None:
        state = flax.serialization.to_bytes(self._state())
        (folder / "networks.msgpack").write_bytes(state)
        self._save_rest(folder, with_replay)

    def load(self, folder: Path, steps: int, updates: int) -> None:
        saved = (folder / "networks.msgpack").read_bytes()
        state = flax.serialization.from_bytes(self._state(), saved)
        policy = self.model.policy
        policy.actor_state, policy.qf1_state = state["actor"], state["critic1"]
        policy.qf2_state, self.model.ent_coef_state = state["critic2"], state["entropy"]
        self.model.key = jax.numpy.asarray(state["key"])
        self.model._acting = actor_layers(policy.actor_state.params)
        self._load_rest(folder, steps, updates)

    def _state(self) -> dict[str, Any]:
        policy = self.model.policy
        return {  # everything that a round of updates computes
            "actor": policy.actor_state,
            "critic1": policy.qf1_state,
            "critic2": policy.qf2_state,
            "entropy": self.model.ent_coef_state,
            "key": self.model.key,
        }
