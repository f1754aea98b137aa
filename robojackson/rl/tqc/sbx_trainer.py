"""TQC in JAX (SBX), with learning and acting at the same time.

XLA computes a round of updates in its own thread; meanwhile the simulations step with the actor of
the previous round (numpy arrays). Acting lags by one round; the seed still determines the result.
"""

import os

os.environ.setdefault("JAX_PLATFORMS", "cpu")
os.environ.setdefault(
    "XLA_FLAGS", "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1"
)

import logging
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import flax.serialization
import jax
import numpy as np
from sbx import TQC
from sbx.common.type_aliases import ReplayBufferSamplesNp
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.vec_env.base_vec_env import VecEnv

from robojackson.rl.config.train_config import TqcConfig
from robojackson.rl.tqc.compiled_programs import keep_compiled_programs
from robojackson.rl.tqc.dense_networks import LOG_STD_RANGE, dense_count
from robojackson.rl.tqc.flax_arrays import dense_layers, filled, tensors_of
from robojackson.rl.tqc.network_arrays import CRITICS, TARGETS, Tensors
from robojackson.rl.tqc.off_policy import OffPolicyTrainer, arguments, is_warming_up
from robojackson.rl.tqc.replay_files import buffer_of
from robojackson.rl.tqc.trainer import Layers, of_seen
from robojackson.rl.tqc.updates import LearnerState, round_of_updates

log = logging.getLogger(__name__)


class OverlappedTQC(TQC):
    """TQC whose updates run while the environments step."""

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self.warmup = 0
        self.seen: int | None = None
        self.burn_in, self.action_penalty = 0, 0.0
        self.noise = np.random.default_rng(self.seed)
        self._acting = dense_layers(self.policy.actor_state.params)

    def predict(  # type: ignore[override]
        self,
        observation: np.ndarray,
        state: Any = None,
        episode_start: Any = None,
        deterministic: bool = False,
    ) -> tuple[np.ndarray, Any]:
        """Sample actions from the actor of the previous round."""
        hidden = observation[:, : self.seen]
        for weight, bias in self._acting[:-2]:
            hidden = np.maximum(hidden @ weight[: hidden.shape[1]] + bias, 0.0)
        (mean_w, mean_b), (std_w, std_b) = self._acting[-2:]
        mean = hidden @ mean_w + mean_b
        if not deterministic:
            log_std = np.clip(hidden @ std_w + std_b, *LOG_STD_RANGE)
            noise = self.noise.standard_normal(mean.shape, np.float32)
            mean = mean + np.exp(log_std) * noise
        return np.tanh(mean), state

    def train(self, gradient_steps: int, batch_size: int) -> None:
        """Wait for the previous round, take its actor, and dispatch the next round."""
        if is_warming_up(self, self.warmup):
            return
        self._acting = dense_layers(self.policy.actor_state.params)
        samples = buffer_of(self).sample(batch_size * gradient_steps)
        if samples.discounts is None:  # returns over one step
            discounts = np.full(batch_size * gradient_steps, self.gamma, np.float32)
        else:
            discounts = samples.discounts.numpy().flatten()
        data = ReplayBufferSamplesNp(
            samples.observations.numpy(),
            samples.actions.numpy(),
            samples.next_observations.numpy(),
            samples.dones.numpy().flatten(),
            samples.rewards.numpy().flatten(),
            discounts,
        )
        policy = self.policy
        learnt = round_of_updates(
            LearnerState(
                policy.actor_state,
                (policy.qf1_state, policy.qf2_state),
                self.ent_coef_state,
                self.key,
            ),
            data,
            self.tau,
            self.target_entropy,
            kept=policy.n_target_quantiles,
            count=gradient_steps,
            delay=self.policy_delay,
            seen=self.seen,
            actor_learns=self.num_timesteps >= self.burn_in,
            penalty=self.action_penalty,
        )
        policy.actor_state, self.ent_coef_state, self.key = learnt.actor, learnt.entropy, learnt.key
        policy.qf1_state, policy.qf2_state = learnt.critics
        self._n_updates += gradient_steps


class SbxTrainer(OffPolicyTrainer):
    """The JAX trainer (`Trainer` protocol)."""

    def __init__(self, env: VecEnv, config: TqcConfig, seed: int, seen: int | None = None) -> None:
        keep_compiled_programs()
        given = arguments(config, seed, env)
        given["policy_kwargs"] |= {"layer_norm": config.layer_norm}
        model = OverlappedTQC(env=env, policy_delay=config.policy_delay, **given)
        model.warmup, model.seen = config.warmup, seen
        start = config.actor_start
        model.burn_in, model.action_penalty = start.burn_in, start.action_penalty
        model.ent_coef_state = jax.tree_util.tree_map(_strong, model.ent_coef_state)
        if config.gsde:
            log.warning("trainer sbx has no gSDE: it explores with plain Gaussian noise")
        if start.log_std_init or start.zero_init:
            _start_heads(model, start.log_std_init, start.zero_init)
        super().__init__(model, {"noise": model.noise})
        if start.zero_init:
            self._act_at_once()

    def learn(self, callback: BaseCallback) -> None:
        """Learn until the callback stops it; wait for the last round."""
        try:
            super().learn(callback)
        finally:  # a round that XLA still computes when Python ends would crash it
            jax.block_until_ready(self._state())  # type: ignore[no-untyped-call]

    def layers(self) -> Layers:
        """Return the actor's layers."""
        layers = dense_layers(self.model.policy.actor_state.params)
        return of_seen(layers[:-1], self.model.seen)

    def acting(self) -> tuple[Layers, int]:
        """Return the acting actor's layers and its gradient updates."""
        layers = of_seen(self.model._acting[:-1], self.model.seen)
        return layers, max(0, self.updates() - self.model.gradient_steps)

    def networks(self) -> Tensors:
        """Return actor and critics by name."""
        policy = self.model.policy
        tensors = tensors_of(policy.actor_state.params, "actor")
        for name, params in self._critics().items():
            tensors |= tensors_of(params, name)
        alpha = self.model.ent_coef_state.params["log_ent_coef"]
        return tensors | {"log_alpha": np.array(jax.device_get(alpha)).reshape(())}

    def start_from(self, tensors: Mapping[str, np.ndarray]) -> None:
        """Load named arrays into the networks."""
        policy = self.model.policy
        policy.actor_state = policy.actor_state.replace(
            params=filled(policy.actor_state.params, tensors, "actor")
        )
        for i, (critic, target) in enumerate(zip(CRITICS, TARGETS, strict=True), 1):
            state = getattr(policy, f"qf{i}_state")
            params = filled(state.params, tensors, critic)
            aimed = filled(state.target_params, tensors, target)
            setattr(policy, f"qf{i}_state", state.replace(params=params, target_params=aimed))
        if "log_alpha" in tensors:
            alpha = _strong(np.float32(tensors["log_alpha"])).reshape(())
            state = self.model.ent_coef_state
            self.model.ent_coef_state = state.replace(params={"log_ent_coef": alpha})
        self.model._acting = dense_layers(policy.actor_state.params)
        self._act_at_once()

    def save(self, folder: Path, replay: Path) -> None:
        """Write networks, optimizers, random state and new transitions."""
        state = flax.serialization.to_bytes(self._state())
        (folder / "networks.msgpack").write_bytes(state)
        self._save_rest(folder, replay)

    def load(self, folder: Path, replay: Path, steps: int, updates: int) -> None:
        """Continue from what `save` wrote."""
        saved = (folder / "networks.msgpack").read_bytes()
        state = flax.serialization.from_bytes(self._state(), saved)
        policy = self.model.policy
        policy.actor_state, policy.qf1_state = state["actor"], state["critic1"]
        policy.qf2_state, self.model.ent_coef_state = state["critic2"], state["entropy"]
        self.model.key = jax.numpy.asarray(state["key"])
        parts = state["acting"]
        self.model._acting = tuple((parts[f"{i}w"], parts[f"{i}b"]) for i in range(len(parts) // 2))
        self._load_rest(folder, replay, steps, updates)

    def _critics(self) -> dict[str, Any]:
        policy = self.model.policy
        states = (policy.qf1_state, policy.qf2_state)
        learnt = {name: state.params for name, state in zip(CRITICS, states, strict=True)}
        return learnt | {n: s.target_params for n, s in zip(TARGETS, states, strict=True)}

    def _state(self) -> dict[str, Any]:
        policy = self.model.policy
        return {  # all results of a round of updates
            "actor": policy.actor_state,
            "critic1": policy.qf1_state,
            "critic2": policy.qf2_state,
            "entropy": self.model.ent_coef_state,
            "key": self.model.key,
            "acting": {
                f"{i}{kind}": array
                for i, layer in enumerate(self.model._acting)
                for kind, array in zip("wb", layer, strict=True)
            },
        }


def _strong(leaf: Any) -> jax.Array:
    """Return an array of a fixed type: a weak one would recompile the updates again and again."""
    return jax.numpy.asarray(np.asarray(leaf))


def _start_heads(model: OverlappedTQC, log_std: float, zero: bool) -> None:
    """Start with another exploration noise, and with actions of zero if so: set the last layers."""
    state = model.policy.actor_state
    last = dense_count(state.params) - 1
    tree = jax.tree_util.tree_map(lambda leaf: leaf, state.params)
    for number, bias in ((last - 1, 0.0), (last, log_std)) if zero else ((last, log_std),):
        head = tree["params"][f"Dense_{number}"]
        head["bias"] = jax.numpy.full_like(head["bias"], bias)
        if zero:
            head["kernel"] = jax.numpy.zeros_like(head["kernel"])
    model.policy.actor_state = state.replace(params=tree)
    model._acting = dense_layers(tree)
