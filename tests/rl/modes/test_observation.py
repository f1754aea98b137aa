"""The onboard observation: only what a robot can measure; the critics alone see the rest."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.pipeline.robot_descriptions import describe_robot
from robojackson.rl.config.train_config import RandomConfig, TqcConfig, TrackConfig, TrainConfig
from robojackson.rl.env.tracking_core import TrackingCore
from robojackson.rl.env.vec_env import TrackingVecEnv
from robojackson.rl.evaluation.policy_evaluation import evaluate_policy
from robojackson.rl.modes.observation import Observer
from robojackson.rl.policy import load_policy
from robojackson.rl.sim.reference_clip import Clip
from robojackson.rl.tqc.trainers import make_trainer
from robojackson.rl.training import train_policy
from robojackson.robot.model import Robot, load_robot
from tests.fixtures.robots import G1

SMALL = TqcConfig(n_envs=4, warmup=8, batch=8, buffer=1000, actor=(12, 8), critic=(10,))
ONBOARD = TrackConfig(observation="onboard")


def moved(sway: ReferenceMotion) -> tuple[np.ndarray, ...]:
    qpos, qvel = sway.qpos[[20]].copy(), sway.qvel[[20]].copy()
    return qpos, qvel, sway.keypoints_w[[20]].copy()


def test_it_has_five_numbers_a_hinge_and_nine(robot: Robot) -> None:
    assert Observer(robot, "onboard").actor_size == 9 + 5 * len(robot.joint_names)


@G1
def test_the_g1_observes_as_many_numbers_as_mjlabs() -> None:
    """Those of its tracking task without state estimation."""
    assert Observer(load_robot(describe_robot("g1")), "onboard").actor_size == 154


def test_where_a_robot_is_and_how_fast_it_travels_is_not_onboard(
    robot: Robot, sway: ReferenceMotion
) -> None:
    observer, target = Observer(robot, "onboard"), Clip(sway).at(np.array([21]))
    qpos, qvel, points = moved(sway)
    still = np.zeros((1, robot.model.nu))
    first = observer.observe(qpos, qvel, points, target, still)[0]
    qpos[:, :3] += [1.0, -2.0, 0.3]
    qvel[:, :3] += [0.5, 0.2, -1.0]
    second = observer.observe(qpos, qvel, points + 0.4, target, still)[0]
    seen = observer.actor_size
    np.testing.assert_array_equal(first[:seen], second[:seen])
    assert not np.allclose(first[seen:], second[seen:]), "the critics see it"
    assert len(first) == observer.size


def test_critics_see_the_state_without_the_noise_of_the_sensors(
    robot: Robot, sway: ReferenceMotion
) -> None:
    """Asymmetric actor and critic (Pinto et al., 2018): noise is the policy's alone."""
    kinds = {"onboard": True, "full": False}
    for kind, clean in kinds.items():
        random = RandomConfig(sensor_noise=1.0)
        config = TrackConfig(observation=kind, random=random)  # type: ignore[arg-type]
        noisy, exact = (
            TrackingCore(robot, sway, one, 4, 0)
            for one in (config, dataclasses.replace(config, random=RandomConfig()))
        )
        seen, known, size = noisy.reset(), exact.reset(), noisy.actor_size
        assert (seen[:, :size] != known[:, :size]).any(axis=1).all(), kind
        if clean:
            np.testing.assert_array_equal(seen[:, size:], known[:, size:])
        else:
            assert size == seen.shape[1]


def test_turning_robot_and_reference_together_changes_nothing_onboard(
    robot: Robot, sway: ReferenceMotion
) -> None:
    from robojackson.rl.modes.paper_mode import facing_ahead

    observer = Observer(robot, "onboard")
    still = np.zeros((1, robot.model.nu))
    found = []
    for motion in (sway, facing_ahead(sway)):
        qpos, qvel, points = moved(motion)
        target = Clip(motion).at(np.array([21]))
        seen = observer.observe(qpos, qvel, points, target, still)
        found.append(seen[0, : observer.actor_size])
    np.testing.assert_allclose(*found, atol=1e-5)


@pytest.mark.medium
@pytest.mark.parametrize("name", ["sbx", "sb3"])
def test_the_actor_never_weighs_what_only_the_critics_see(
    robot: Robot, sway: ReferenceMotion, name: str
) -> None:
    core = TrackingCore(robot, sway, ONBOARD, 4, 0)
    env = TrackingVecEnv(core)
    trainer = make_trainer(name, env, SMALL, 0, core.actor_size)
    seen = env.reset()
    other = seen.copy()
    other[:, core.actor_size :] += 1.0
    actions = [trainer.model.predict(o, deterministic=True)[0] for o in (seen, other)]  # type: ignore[attr-defined]
    np.testing.assert_array_equal(*actions)
    assert trainer.layers()[0][0].shape[0] == core.actor_size
    env.close()


@pytest.mark.medium
@pytest.mark.parametrize("name", ["sbx", "sb3"])
def test_a_policy_of_such_a_training_takes_the_onboard_numbers(
    robot: Robot, sway: ReferenceMotion, tmp_path: Path, name: str
) -> None:
    config = TrainConfig(trainer=name, steps=200, tqc=SMALL, track=ONBOARD)  # type: ignore[arg-type]
    policy = load_policy(train_policy(sway, robot, config, tmp_path).policy)
    assert policy.observation_size == 9 + 5 * len(robot.joint_names)
    from robojackson.rl.config.train_config import EvaluateConfig

    brief = EvaluateConfig(seconds=0.15, phases=2, resets=1)
    assert len(evaluate_policy(policy, sway, robot, brief).rollout_qpos) > 1
