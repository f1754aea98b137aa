"""A tracker is evaluated as a policy is: the same physics, starts and table."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from robojackson.api import evaluation
from robojackson.api.trackers import load_tracker
from robojackson.errors import BadPolicy
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.rl.config.evaluate_config import EvaluateConfig
from robojackson.rl.config.train_config import ControlConfig
from robojackson.rl.evaluation.policy_evaluation import evaluate_policy
from robojackson.rl.evaluation.tracker_driver import tracker_driver
from robojackson.rl.sim.motors import Motors
from robojackson.rl.sim.reference_clip import Clip
from robojackson.rl.sim.simulation import Simulation
from robojackson.rl.trackers.tracker import TrackerInput
from robojackson.rl.trackers.tracker_description import TrackerDescription
from robojackson.rl.trackers.twist2 import Twist2Tracker
from robojackson.robot.model import Robot
from tests.fixtures.robots import robot_motion
from tests.fixtures.stand_in_tracker import stand_in

FEW = EvaluateConfig(seconds=0.6, phases=2, resets=1, threads=1)


class Replay:
    """A tracker that gives the next step's angles, and keeps what it is shown."""

    window: tuple[int, ...] = (1, 4)
    control = ControlConfig(feedforward=0.0, feedback=0.0)
    sees_ahead, sees_travel = False, True

    def __init__(self, description: TrackerDescription) -> None:
        self.description = description
        self.begun: list[int] = []
        self.shown: list[TrackerInput] = []

    def equip(self, robot: Robot) -> Robot:
        return robot

    def follow(self, robot: Robot, n: int) -> "Replay":
        self._hinge = Motors.of(robot.model).hinge
        self.begun.append(n)
        return self

    def targets(self, seen: TrackerInput) -> np.ndarray:
        self.shown.append(seen)
        return seen.window[0].qpos[:, 7:][:, self._hinge]


@pytest.fixture
def replay(tmp_path: Path) -> Replay:
    return Replay(stand_in(tmp_path)[1])


def test_a_tracker_that_gives_the_reference_is_the_bare_reference(
    replay: Replay, robot: Robot, sway: ReferenceMotion
) -> None:
    found = evaluate_policy(replay, sway, robot, FEW)
    rows = {
        name: [row for row in found.rows if row["policy"] == name]
        for name in ("trained", "zero_residual")
    }
    for own, bare in zip(*rows.values(), strict=True):
        assert own["survived_s"] == bare["survived_s"]
        assert own["site_error_m"] == pytest.approx(bare["site_error_m"])


def test_the_window_holds_the_steps_that_are_requested(
    replay: Replay, robot: Robot, sway: ReferenceMotion
) -> None:
    evaluate_policy(replay, sway, robot, FEW)
    clip = Clip(sway)
    starts = np.array([0, 40, 0])
    for t, seen in enumerate(replay.shown[:30]):
        for step, ahead in zip(seen.window, (1, 4), strict=True):
            np.testing.assert_array_equal(step.qpos, clip.at(starts + t + ahead).qpos)


def test_a_new_simulation_begins_without_the_memory_of_the_last(
    replay: Replay, robot: Robot, sway: ReferenceMotion
) -> None:
    driver = tracker_driver(replay, robot, sway)
    following, none = Clip(sway).at(np.zeros(2, int)), np.zeros(0)
    sims = [Simulation(robot, driver.control, 2) for _ in range(2)]
    for sim in (sims[0], sims[0], sims[1]):
        driver.command(sim, following, none, none)
    assert replay.begun[1:] == [2, 2]


@pytest.mark.medium
def test_a_stand_in_network_gets_rows_and_a_name(
    tmp_path: Path, robot: Robot, sway: ReferenceMotion
) -> None:
    file, description = stand_in(tmp_path)
    named: set[str] = set()
    tracker = Twist2Tracker(description, file)
    found = evaluate_policy(tracker, sway, robot, FEW, lambda name, *_: named.add(name))
    assert found.summary["tracker"] == "standin"
    assert "standin" in named
    assert "trained" not in named
    assert sum(row["policy"] == "trained" for row in found.rows) == 3
    assert set(found.summary["baselines"]) == {"statue", "mean_pose", "zero_residual", "random"}
    assert 0 < found.summary["survived_s"] <= 0.6


@pytest.mark.medium
def test_the_passport_of_a_tracker_is_its_own_under_other_physics(
    tmp_path: Path, robot: Robot, sway: ReferenceMotion
) -> None:
    file, description = stand_in(tmp_path)
    short = replace(FEW, seconds=0.15, phases=1, passport=True)
    found = evaluate_policy(Twist2Tracker(description, file), sway, robot, short)
    cases = {row["case"]: row["site_error_m"] for row in found.summary["passport"]}
    assert len(cases) > 10
    assert cases["gains x 0.8"] != cases["nominal"]


def test_a_tracker_of_another_robot_is_refused_with_those_of_the_motions() -> None:
    regulator = load_tracker("regulator")
    with pytest.raises(BadPolicy, match="'g1', not 'humanoid'; for humanoid: none"):
        evaluation.evaluate_policy(regulator, robot_motion("hip_shake"))


def test_a_motion_of_another_robot_is_one_line(
    tmp_path: Path, robot: Robot, sway: ReferenceMotion
) -> None:
    file, description = stand_in(tmp_path)
    other = replace(description, robot="g1")
    with pytest.raises(BadPolicy, match="tracker 'standin' drives robot 'g1', not 'humanoid'"):
        evaluate_policy(Twist2Tracker(other, file), sway, robot, FEW)
