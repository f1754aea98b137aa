"""sb3-contrib and SBX do the same: one batch, one set of weights, the same noise, k updates."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from stable_baselines3.common.type_aliases import ReplayBufferSamples

from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.rl.config.train_config import PaperConfig, TqcConfig
from robojackson.rl.env.tracking_core import TrackingCore
from robojackson.rl.env.vec_env import TrackingVecEnv
from robojackson.rl.tqc.network_arrays import Networks, fitted
from robojackson.rl.tqc.replay_files import buffer_of
from robojackson.rl.tqc.trainers import make_trainer
from robojackson.robot.model import Robot

BATCH, UPDATES = 16, 4
TQC = TqcConfig(
    preset="paper", n_envs=2, warmup=1, batch=BATCH, actor=(24, 16), critic=(24, 16), buffer=1000
)
KINDS = {"plain": TQC, "normalised": replace(TQC, layer_norm=True)}


def noise(shape: tuple[int, ...]) -> np.ndarray:
    """Return the numbers that both trainers draw, always the same; JAX's distribution draws actions
    x batch."""
    drawn = np.random.default_rng(7).normal(size=(BATCH, 17)).astype(np.float32)
    return (drawn if shape[-1] == 17 else drawn.T).reshape(shape)


def transitions() -> ReplayBufferSamples:
    """Return a batch for each update, one after the other."""
    rng = np.random.default_rng(3)
    n = UPDATES * BATCH
    shapes = {"observations": 348, "actions": 17, "next_observations": 348}
    drawn = {name: rng.normal(size=(n, width)) for name, width in shapes.items()}
    drawn |= {"dones": rng.random((n, 1)) < 0.2, "rewards": rng.normal(4, 1, (n, 1))}
    drawn["actions"] = np.tanh(drawn["actions"])
    ready = {k: torch.from_numpy(v.astype(np.float32)) for k, v in drawn.items()}
    return ReplayBufferSamples(**ready, discounts=None)


def part(rows: ReplayBufferSamples, i: int) -> ReplayBufferSamples:
    """Return the batch of one update."""
    span = slice(i * BATCH, (i + 1) * BATCH)
    return ReplayBufferSamples(*(None if x is None else x[span] for x in rows))


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_k_updates_of_both_trainers_agree(
    kind: str, robot: Robot, sway: ReferenceMotion, monkeypatch: pytest.MonkeyPatch
) -> None:
    from tensorflow_probability.substrates.jax.internal import samplers

    env = TrackingVecEnv(TrackingCore(robot, sway, PaperConfig(), 2, 0))
    monkeypatch.setattr(
        "torch.distributions.normal._standard_normal",
        lambda shape, dtype, device: torch.from_numpy(noise(tuple(shape))),
    )
    monkeypatch.setattr(
        samplers, "normal", lambda shape, *rest, **more: noise(tuple(map(int, shape)))
    )
    torch_trainer = make_trainer("sb3", env, KINDS[kind], seed=0)
    jax_trainer = make_trainer("sbx", env, KINDS[kind], seed=1)
    jax_trainer.start_from(torch_trainer.networks())
    before = torch_trainer.networks()
    rows = transitions()
    batches = {torch_trainer: [part(rows, i) for i in range(UPDATES)], jax_trainer: [rows]}
    for trainer, given in batches.items():
        model = trainer.model  # type: ignore[attr-defined]
        model.warmup = 0
        sample = iter(given).__next__
        monkeypatch.setattr(buffer_of(model), "sample", lambda *a, take=sample, **k: take())
        model.train(gradient_steps=UPDATES, batch_size=BATCH)
    ours, theirs = jax_trainer.networks(), torch_trainer.networks()
    for name, array in theirs.items():
        np.testing.assert_allclose(ours[name], array, atol=1e-4, err_msg=name)
    moved = np.abs(theirs["actor.0.weight"] - before["actor.0.weight"]).max()
    assert moved > 5e-4


@pytest.mark.parametrize("trainer_name", ["sbx", "sb3"])
def test_what_goes_into_normalised_critics_comes_out(
    trainer_name: str, robot: Robot, sway: ReferenceMotion
) -> None:
    env = TrackingVecEnv(TrackingCore(robot, sway, PaperConfig(), 2, 0))
    trainer = make_trainer(trainer_name, env, KINDS["normalised"], seed=0)
    given = {name: array + 0.1 for name, array in trainer.networks().items()}
    assert {"critic1.norm.0.scale", "target2.norm.1.offset"} <= set(given)
    trainer.start_from(given)
    for name, array in trainer.networks().items():
        np.testing.assert_allclose(array, given[name], atol=1e-6, err_msg=name)
    shaped = fitted(TQC, Networks(given, {}), critics=True)
    assert (shaped.layer_norm, shaped.critic) == (True, (24, 16))
