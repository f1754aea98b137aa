"""A tracker's numbers on its robot: gains alone change, and every name is known."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from robojackson.errors import BadConfiguration, BadPolicy, UnknownName
from robojackson.pipeline.tracker_descriptions import describe_tracker, require_tracker
from robojackson.rl.sim.motors import Motors
from robojackson.rl.trackers.equipment import equip, layout_of
from robojackson.rl.trackers.tracker_description import TrackerDescription
from tests.fixtures.robots import description as robot_description
from tests.fixtures.robots import stock
from tests.fixtures.stand_in_tracker import stand_in


@pytest.fixture
def tracker(tmp_path: Path) -> TrackerDescription:
    return stand_in(tmp_path)[1]


def test_gains_are_the_trackers_and_torque_limits_the_robots(tracker) -> None:
    robot = stock()
    own = equip(robot, tracker)
    elbow = robot.joint_names.index("left_elbow")
    assert (own.actuation.stiffness[elbow], own.actuation.damping[elbow]) == (30.0, 1.0)
    assert set(
        np.delete(own.actuation.stiffness, [elbow, robot.joint_names.index("right_elbow")])
    ) == {90.0}
    np.testing.assert_array_equal(Motors.of(own.model).limit, Motors.of(robot.model).limit)
    np.testing.assert_array_equal(own.model.geom_friction, robot.model.geom_friction)
    np.testing.assert_array_equal(own.model.body_mass, robot.model.body_mass)
    assert own.model.opt.timestep == robot.model.opt.timestep


def test_a_shorter_physics_step_leaves_the_control_step(tracker) -> None:
    robot = stock()
    own = equip(robot, replace(tracker, timestep=0.0015))
    assert own.substeps * own.model.opt.timestep == pytest.approx(0.015)
    assert robot.model.opt.timestep == 0.003


@pytest.mark.parametrize(
    ("change", "error", "words"),
    [
        ({"robot": "g1"}, BadPolicy, "drives robot 'g1', not 'humanoid'"),
        ({"control_dt": 0.02}, BadPolicy, "acts every 20 ms and robot 'humanoid' every 15 ms"),
        ({"joints": ("left_kne",)}, UnknownName, "left_kne"),
        ({"joints": stock().joint_names[1:]}, BadConfiguration, "'abdomen_z' is missing"),
        ({"joints": (*stock().joint_names, "left_knee")}, BadConfiguration, "named twice"),
        ({"unmeasured_speeds": ("*_ankle",)}, UnknownName, "ankle"),
    ],
)
def test_what_does_not_fit_the_robot_is_one_line(tracker, change, error, words) -> None:
    with pytest.raises(error, match=words) as caught:
        layout_of(stock(), replace(tracker, **change))
    assert "\n" not in str(caught.value)


def test_a_hinge_without_gains_is_named(tracker) -> None:
    with pytest.raises(BadConfiguration, match="stiffness: none for joint"):
        equip(stock(), replace(tracker, stiffness={"*_knee": 5.0}))


def test_the_shipped_description_names_29_hinges_of_the_g1_once() -> None:
    twist2 = describe_tracker("twist2")
    assert (twist2.robot, len(set(twist2.joints)), twist2.file.size) == ("g1", 29, 3184908)
    limits = robot_description("g1").torque_limits
    assert twist2.control_dt == robot_description("g1").control_dt
    assert limits
    assert "*" not in twist2.stiffness


def test_a_robot_without_a_tracker_is_one_line_that_lists_them() -> None:
    with pytest.raises(
        BadPolicy, match=r"no tracker for robot 'strong'; trackers: .*twist2 \(g1\)"
    ):
        require_tracker("strong")


def test_a_tracker_of_another_robot_is_one_line_that_lists_those_of_the_robot() -> None:
    with pytest.raises(
        BadPolicy, match=r"'regulator' drives robot 'g1', not 't1'; for t1: reg.*t1$"
    ):
        require_tracker("t1", "regulator")
    with pytest.raises(BadPolicy, match=r"not 'strong'; for strong: none$"):
        require_tracker("strong", "regulator")


def test_none_is_no_tracker() -> None:
    assert require_tracker("strong", "none") is None


@pytest.mark.parametrize("robot", ["g1_23", "t1"])
def test_the_other_fetched_robots_dance_at_once_by_a_yaml_alone(robot: str) -> None:
    found = require_tracker(robot)
    assert found is not None
    assert (found.network, found.robot, found.file) == ("regulator", robot, None)
    assert found.control_dt == robot_description(robot).control_dt
