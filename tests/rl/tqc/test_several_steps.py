"""Returns over several steps: what the critics learn from, against a sum over the replay buffer."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.rl.config.train_config import PaperConfig, TqcConfig
from robojackson.rl.env.tracking_core import TrackingCore
from robojackson.rl.env.vec_env import TrackingVecEnv
from robojackson.rl.tqc import sbx_trainer
from robojackson.rl.tqc.sbx_trainer import SbxTrainer
from robojackson.rl.tqc.trainers import make_trainer
from robojackson.robot.model import Robot

SMALL = TqcConfig(
    n_envs=2, warmup=8, batch=16, buffer=1000, actor=(24, 16), critic=(24, 16),
    steps_per_round=4, updates_per_round=8, policy_delay=1,
)  # fmt: skip
FALLS_AND_ENDS = 400
"""Steps of two robots, among them falls."""


def environment(robot: Robot, sway: ReferenceMotion) -> TrackingVecEnv:
    return TrackingVecEnv(TrackingCore(robot, sway, PaperConfig(seconds=0.5), 2, 0))


def learnt_from(
    robot: Robot, sway: ReferenceMotion, monkeypatch: pytest.MonkeyPatch, config: TqcConfig
) -> tuple[Any, Any]:
    """Return the last samples that a trainer learnt from, and its replay buffer."""
    seen: list[Any] = []
    run = sbx_trainer.round_of_updates

    def spied(learnt: Any, samples: Any, *args: Any, **named: Any) -> Any:
        seen.append(samples)
        return run(learnt, samples, *args, **named)

    monkeypatch.setattr(sbx_trainer, "round_of_updates", spied)
    trainer = SbxTrainer(environment(robot, sway), config, seed=0)
    trainer.model.learn(FALLS_AND_ENDS)
    return seen[-1], trainer.model.replay_buffer


@pytest.mark.parametrize("steps", [1, 3])
def test_a_target_adds_rewards_up_to_the_end_of_an_episode(
    robot: Robot, sway: ReferenceMotion, monkeypatch: pytest.MonkeyPatch, steps: int
) -> None:
    config = replace(SMALL, n_steps=steps)
    samples, buffer = learnt_from(robot, sway, monkeypatch, config)
    last, lengths, fell = buffer.pos - 1, list[int](), 0
    for i, observation in enumerate(samples.observations):
        (row, env), *others = np.argwhere((buffer.observations == observation).all(2))
        assert not others
        value, discount, ends = 0.0, 1.0, row
        for ends in range(row, min(row + steps, last + 1)):
            value += discount * buffer.rewards[ends, env]
            discount *= config.gamma
            if buffer.dones[ends, env]:
                break
        over = buffer.dones[ends, env] * (1 - buffer.timeouts[ends, env])
        assert samples.rewards[i] == pytest.approx(value, rel=1e-4, abs=1e-4)
        assert samples.discounts[i] == pytest.approx(discount, rel=1e-5)
        assert samples.dones[i] == over
        np.testing.assert_array_equal(
            samples.next_observations[i], buffer.next_observations[ends, env]
        )
        lengths.append(ends - row + 1)
        fell += over
    assert fell
    assert set(lengths) == set(range(1, steps + 1))


def test_both_trainers_learn_from_as_many_steps(robot: Robot, sway: ReferenceMotion) -> None:
    env = environment(robot, sway)
    for name in ("sbx", "sb3"):
        trainer = make_trainer(name, env, SMALL, 0)
        trainer.model.learn(8)
        assert trainer.model.replay_buffer.n_steps == SMALL.n_steps == 3


@pytest.mark.parametrize("preset", ["paper", "released"])
def test_the_papers_update_bootstraps_after_one_step(preset: Any) -> None:
    assert TqcConfig(preset=preset).n_steps == 1
