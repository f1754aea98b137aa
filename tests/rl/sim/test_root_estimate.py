"""Robots that are driven by what they know of themselves."""

import dataclasses

import numpy as np
import pytest

from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.rl.config.train_config import ControlConfig, RandomConfig, ResetConfig, TrackConfig
from robojackson.rl.env.tracking_core import TrackingCore
from robojackson.rl.evaluation.controllers import trained_driver
from robojackson.rl.feedback.driven_clip import driven_clip
from robojackson.rl.sim import accelerometer
from robojackson.rl.sim.reference_clip import Clip
from robojackson.rl.sim.simulation import Simulation
from robojackson.rl.trackers.regulator_tracker import RegulatorTracker
from robojackson.rl.trackers.tracker_description import TrackerDescription
from robojackson.robot.model import Robot
from tests.fixtures.resumed_environments import require_the_same_after_resuming

N = 3
ESTIMATED = ControlConfig(
    feedforward=1.0, feedback=1.0, feedback_path="reference", root_state="estimated"
)


def placed(robot: Robot, clip: Clip, start: int, control: ControlConfig = ESTIMATED) -> Simulation:
    sim, at = Simulation(robot, control, N), clip.at(np.full(N, start))
    sim.place(np.arange(N), at.qpos, at.qvel + 0.02 * np.arange(N)[:, None])
    return sim


@pytest.fixture(scope="module")
def clip(robot: Robot, sway: ReferenceMotion) -> Clip:
    return driven_clip(robot, sway, ESTIMATED)


def test_it_drives_a_robot_as_the_tracker_does(
    robot: Robot, sway: ReferenceMotion, clip: Clip, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(accelerometer, "NOISE_M_S2", 0.0)
    tracker = RegulatorTracker(
        TrackerDescription(
            name="own", robot="humanoid", network="regulator", licence="ours", homepage="here",
            trained_on="nothing", control_dt=sway.dt, root_state="estimated",
        )
    )  # fmt: skip
    driver = trained_driver(tracker, robot, sway)
    exact = dataclasses.replace(ESTIMATED, root_state=None)
    ours, theirs = placed(robot, clip, 7), placed(robot, clip, 7, exact)
    apart, start = 0.0, np.full(N, 7)
    for step in range(25):
        following = clip.at(start + step + 1)
        unknown = theirs.reference_angles(following)
        targets = driver.command(theirs, following, start, np.zeros((N, robot.model.nu)))
        np.testing.assert_allclose(ours.reference_angles(following), targets, atol=1e-9)
        apart = max(apart, float(np.abs(unknown - targets).max()))
        ours.step(targets)
        theirs.step(targets)
    assert apart > 1e-3, "an estimate is not the exact root"


def test_the_true_root_is_not_looked_at(robot: Robot, clip: Clip) -> None:
    """Nothing but what a robot measures decides: another place and speed of the root change
    nothing but through the accelerometer, which is read before."""
    first, second = placed(robot, clip, 0), placed(robot, clip, 0)
    for sim in (first, second):
        sim.reference_angles(clip.at(np.full(N, 1)))
        sim.step(np.tile(robot.standing[7:][sim.motors.hinge], (N, 1)))
    second.qpos[:, :2] += 5.0
    following = clip.at(np.full(N, 2))
    np.testing.assert_array_equal(
        first.reference_angles(following), second.reference_angles(following)
    )


def test_asked_twice_it_answers_the_same(robot: Robot, clip: Clip) -> None:
    sim = placed(robot, clip, 0)
    for step in range(1, 5):
        following = clip.at(np.full(N, step))
        targets = sim.reference_angles(following)
        np.testing.assert_array_equal(sim.reference_angles(following), targets)
        sim.step(targets)


def test_a_robot_that_is_placed_begins_anew_and_the_others_go_on(
    robot: Robot, clip: Clip, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(accelerometer, "NOISE_M_S2", 0.0)
    sim, alone, other = (placed(robot, clip, 0) for _ in range(3))
    for step in range(1, 5):
        following = clip.at(np.full(N, step))
        for each in (sim, alone):
            each.step(each.reference_angles(following))
    at, row = clip.at(np.zeros(N, int)), np.array([1])
    sim.place(row, at.qpos[row], at.qvel[row] + 0.02)
    mixed = clip.at(np.array([5, 1, 5]))
    found = sim.reference_angles(mixed)
    untouched = alone.reference_angles(clip.at(np.full(N, 5)))
    np.testing.assert_allclose(found[[0, 2]], untouched[[0, 2]], atol=1e-9)
    fresh = other.reference_angles(clip.at(np.ones(N, int)))
    np.testing.assert_array_equal(found[1], fresh[1])


@pytest.mark.parametrize("noise", [0.0, 1.0])
def test_a_resumed_training_goes_on_with_the_same_estimates(
    noise: float, robot: Robot, sway: ReferenceMotion
) -> None:
    config = TrackConfig(
        observation="onboard",
        control=ESTIMATED,
        random=RandomConfig(sensor_noise=noise),
        reset=ResetConfig(stand_share=0.5),
        episode_seconds=0.3,
    )
    first, second = (TrackingCore(robot, sway, config, N, 3) for _ in range(2))
    assert first.actor_size < first.observation_size
    actions = np.random.default_rng(1).uniform(-0.1, 0.1, (50, N, robot.model.nu))
    require_the_same_after_resuming(first, second, actions, 23)
