"""Training that begins with actions of zero: quiet start, critics first, small actions."""

from dataclasses import replace

import numpy as np
import pytest

from robojackson.errors import BadConfiguration
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.pipeline.pipeline_config import PipelineConfig
from robojackson.pipeline.yaml_loader import load
from robojackson.rl.config.train_config import PaperConfig, TqcConfig
from robojackson.rl.env.tracking_core import TrackingCore
from robojackson.rl.env.vec_env import TrackingVecEnv
from robojackson.rl.tqc.sbx_trainer import SbxTrainer
from robojackson.robot.model import Robot

QUIET = TqcConfig(
    preset="polish", n_envs=2, warmup=8, batch=16, buffer=1000, actor=(24, 16), critic=(24, 16),
    steps_per_round=4, updates_per_round=8, burn_in=80,
)  # fmt: skip


def trained(robot: Robot, sway: ReferenceMotion, config: TqcConfig, steps: int) -> SbxTrainer:
    """Return a trainer after some steps of two simulations."""
    env = TrackingVecEnv(TrackingCore(robot, sway, PaperConfig(), 2, 0))
    trainer = SbxTrainer(env, config, seed=0)
    trainer.model.learn(steps)
    return trainer


def action_size(trainer: SbxTrainer) -> float:
    """Return the mean squared action in random states, without noise."""
    hidden = np.random.default_rng(0).normal(size=(64, 348)).astype(np.float32)
    *layers, last = trainer.layers()
    for weight, bias in layers:
        hidden = np.maximum(hidden @ weight + bias, 0.0)
    return float(np.mean(np.tanh(hidden @ last[0] + last[1]) ** 2))


def test_it_begins_with_actions_of_zero_and_little_noise(
    robot: Robot, sway: ReferenceMotion
) -> None:
    trainer = trained(robot, sway, QUIET, 8)
    assert action_size(trainer) == 0.0
    stored = trainer.model.replay_buffer.actions[:4]
    assert 0.0 < stored.std() < 2 * np.exp(-2.5)


@pytest.mark.slow
def test_critics_learn_before_the_actor(robot: Robot, sway: ReferenceMotion) -> None:
    begun, burnt_in, after = (trained(robot, sway, QUIET, steps) for steps in (8, 72, 160))
    first, second, third = (trainer.networks() for trainer in (begun, burnt_in, after))
    for name in ("actor.0.weight", "mean.weight", "log_std.bias"):
        np.testing.assert_array_equal(first[name], second[name])
    assert not np.array_equal(first["critic1.0.weight"], second["critic1.0.weight"])
    assert not np.array_equal(second["mean.weight"], third["mean.weight"])


@pytest.mark.slow
def test_the_penalty_keeps_actions_small(robot: Robot, sway: ReferenceMotion) -> None:
    free, held = (
        action_size(trained(robot, sway, replace(QUIET, burn_in=0, action_penalty=p), 400))
        for p in (0.0, 100.0)
    )
    assert 0.0 < held < 0.5 * free


def test_the_reference_trainer_refuses_it() -> None:
    with pytest.raises(BadConfiguration, match=r"preset polish.* need trainer sbx"):
        load(PipelineConfig, "base", {"train.trainer": "sb3", "train.tqc.preset": "polish"})
