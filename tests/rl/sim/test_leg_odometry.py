"""Place and velocity of the root from a robot's own measurements."""

import copy
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest
from pydantic import ValidationError

from robojackson.errors import BadPolicy
from robojackson.geometry.rotations import quat_to_matrix
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.rl.config.train_config import ControlConfig, EvaluateConfig
from robojackson.rl.evaluation.policy_evaluation import evaluate_policy
from robojackson.rl.sim.accelerometer import NOISE_M_S2, Accelerometer, swing_velocity
from robojackson.rl.sim.leg_odometry import LegOdometry
from robojackson.rl.sim.simulation import Simulation
from robojackson.rl.trackers.regulator_tracker import RegulatorTracker
from robojackson.rl.trackers.tracker_description import TrackerDescription, TrackerFile
from robojackson.robot.model import Robot
from tests.fixtures.robots import robot_motion

G = np.array([0.0, 0.0, -9.81])
EXACT = TrackerDescription(
    name="exact", robot="humanoid", network="regulator", licence="ours", trained_on="nothing",
    homepage="here", control_dt=0.015,
)  # fmt: skip


class Measured(NamedTuple):
    """Arguments of `LegOdometry.estimate`."""

    qpos: np.ndarray
    qvel: np.ndarray
    force: np.ndarray
    path: tuple[np.ndarray, np.ndarray]


def measured(motion: ReferenceMotion, i: int) -> Measured:
    """Return what a robot measures that follows a motion exactly; not a number where it cannot."""
    path = motion.qpos[i : i + 1].copy(), motion.qvel[i : i + 1].copy()
    qpos, qvel = path[0].copy(), path[1].copy()
    change = (motion.qvel[i, :3] - motion.qvel[max(i - 1, 0), :3]) / motion.dt - G
    force = change[None] @ quat_to_matrix(qpos[:, 3:7])[0]
    qpos[:, :3] = qvel[:, :3] = np.nan
    return Measured(qpos, qvel, force, path)


def test_a_motion_with_steps_is_followed_to_centimetres_without_its_root(robot: Robot) -> None:
    motion = robot_motion("dance_b")
    odometry, off, place = LegOdometry(robot, motion.dt), [], np.zeros(3)
    for i in range(len(motion)):
        qpos, qvel = odometry.estimate(*measured(motion, i))
        place = qpos[0, :3] - motion.qpos[i, :3]
        off.append(np.linalg.norm(qvel[0, :3] - motion.qvel[i, :3]))
    assert np.median(off) < 0.05
    assert np.abs(place).max() < 0.1


def test_a_robot_is_as_high_as_its_path_where_both_have_sunk_into_the_floor(
    robot: Robot, sway: ReferenceMotion
) -> None:
    """A millimetre is the load of a leg: a level floor below the lowest point would hide it."""
    seen = measured(sway, 0)
    sunk = seen.path[0].copy()
    sunk[:, 2] -= 0.004
    qpos, _ = LegOdometry(robot, sway.dt).estimate(*seen._replace(path=(sunk, seen.path[1])))
    np.testing.assert_allclose(qpos[:, 2], sunk[:, 2], atol=1e-9)


def test_a_foot_that_rolls_as_on_the_path_does_not_move_the_root(
    robot: Robot, sway: ReferenceMotion
) -> None:
    seen = measured(sway, 0)
    speeds = seen.path[1].copy()
    speeds[:, 6:] = 0.05
    rolling = seen.qvel.copy()
    rolling[:, 3:] = speeds[:, 3:]
    moving = seen._replace(qvel=rolling, path=(seen.path[0], speeds))
    _, qvel = LegOdometry(robot, sway.dt).estimate(*moving)
    np.testing.assert_allclose(qvel[:, :3], speeds[:, :3], atol=1e-9)
    resting = seen._replace(qvel=rolling, path=(seen.path[0], np.zeros_like(speeds)))
    _, qvel = LegOdometry(robot, sway.dt).estimate(*resting)
    assert np.abs(qvel[:, :3]).max() > 0.005


def test_a_push_is_noticed_though_the_soles_rest(robot: Robot, sway: ReferenceMotion) -> None:
    odometry = LegOdometry(robot, sway.dt)
    quiet = [measured(sway, 0)] * 3
    for seen in quiet:
        _, qvel = odometry.estimate(*seen)
    before = qvel[0, :3]
    pushed = quiet[0]._replace(force=quiet[0].force + [1.0 / sway.dt, 0.0, 0.0])
    _, qvel = odometry.estimate(*pushed)
    assert 0.9 < np.linalg.norm(qvel[0, :3] - before) < 1.1


def test_an_accelerometer_beside_the_root_tells_the_same(robot: Robot) -> None:
    """Of a robot that turns fast, one that is taken to sit in the root misleads."""
    motion, off = robot_motion("dance_b"), {}
    place = (0.0, 0.1, 0.4)
    beside = replace(robot, description=replace(robot.description, imu=place))
    swing = swing_velocity(motion.qpos, motion.qvel, np.array(place))
    change = np.diff(swing, axis=0, prepend=swing[:1]) / motion.dt
    felt = np.einsum("nji,nj->ni", quat_to_matrix(motion.qpos[:, 3:7]), change)
    for name, machine, more in (
        ("root", robot, 0.0), ("beside", beside, 1.0), ("wrong", robot, 1.0),
    ):  # fmt: skip
        odometry, states = LegOdometry(machine, motion.dt), []
        for i in range(80):
            seen = measured(motion, i)
            seen = seen._replace(force=seen.force + more * felt[i])
            states.append(np.concatenate([each[0, :3] for each in odometry.estimate(*seen)]))
        off[name] = np.array(states)
    np.testing.assert_allclose(off["beside"], off["root"], atol=1e-9)
    assert np.abs(off["wrong"] - off["root"]).max() > 0.01


def test_a_copy_continues_by_itself(robot: Robot, sway: ReferenceMotion) -> None:
    first = LegOdometry(robot, sway.dt)
    first.estimate(*measured(sway, 0))
    second = copy.copy(first)
    for i in range(1, 5):
        first.estimate(*measured(sway, i))
    again, _ = second.estimate(*measured(sway, 1))
    fresh = LegOdometry(robot, sway.dt)
    fresh.estimate(*measured(sway, 0))
    np.testing.assert_array_equal(again, fresh.estimate(*measured(sway, 1))[0])


def test_the_accelerometer_shows_the_opposite_of_gravity_at_rest_and_nothing_in_a_fall(
    robot: Robot,
) -> None:
    sim = Simulation(robot, ControlConfig(law="torque"), 1)
    tilted = robot.standing[None].copy()
    tilted[0, 2], tilted[0, 3:7] = 5.0, [np.cos(0.3), np.sin(0.3), 0.0, 0.0]
    sim.place(np.array([0]), tilted, np.zeros((1, robot.model.nv)))
    accelerometer = Accelerometer(sim)
    at_rest = accelerometer.read()[0]
    expected = -G @ quat_to_matrix(tilted[:, 3:7])[0]
    np.testing.assert_allclose(at_rest, expected, atol=5 * NOISE_M_S2)
    sim.step(np.zeros((1, robot.model.nu)))
    falling = accelerometer.read()[0]  # springs of the hinges move the root a little
    assert np.linalg.norm(falling) < 0.3 * np.linalg.norm(G)


@pytest.mark.slow
def test_the_feedback_holds_on_with_estimates(robot: Robot, sway: ReferenceMotion) -> None:
    found = {}
    for state in ("exact", "estimated"):
        tracker = RegulatorTracker(replace(EXACT, root_state=state))
        tracker.control = replace(tracker.control, feedback_path="reference")
        config = EvaluateConfig(phases=3, resets=1, seconds=3.0)
        found[state] = float(
            str(evaluate_policy(tracker, sway, robot, config).summary["survived_s"])
        )
    assert found["estimated"] > 0.8 * found["exact"]


def test_only_the_feedback_has_a_root_to_estimate() -> None:
    file = TrackerFile(name="net.safetensors", size=1, sha256="0" * 64)
    with pytest.raises(ValidationError, match="does not see place and velocity of the root"):
        replace(EXACT, network="policy", file=file, root_state="estimated")


def test_a_performance_has_no_accelerometer(robot: Robot, sway: ReferenceMotion) -> None:
    from robojackson.api.performances import perform

    tracker = RegulatorTracker(replace(EXACT, root_state="estimated"))
    with pytest.raises(BadPolicy, match=r"'exact' .*one motion.*regulator"):
        perform([sway], robot, tracker=tracker)
