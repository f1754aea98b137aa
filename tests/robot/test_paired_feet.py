"""Feet that touch the floor by `<contact><pair>` alone are feet as those of the stock robot are."""

from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest

from robojackson.retarget.feasibility.inverse_dynamics import sole_friction
from robojackson.retarget.solver.collision import Detector
from robojackson.rl.modes.reset_states import default_standing_pose
from robojackson.rl.sim.variation import Variation, varied
from robojackson.robot.model import Robot, load_robot
from tests.fixtures.own_robot import BY_PAIRS, described_on


@pytest.fixture
def paired(tmp_path: Path) -> Robot:
    return load_robot(described_on(tmp_path, *BY_PAIRS))


def frictions(robot: Robot) -> set[float]:
    """Return the sliding friction of all contacts of a robot that stands 1 cm in the floor."""
    data = mujoco.MjData(robot.model)
    data.qpos[:] = default_standing_pose(robot)
    data.qpos[2] -= 0.01
    mujoco.mj_forward(robot.model, data)
    assert data.ncon >= 2
    return {round(float(contact.friction[0]), 6) for contact in data.contact}


def test_they_stand_on_the_floor_and_are_the_feet(robot: Robot, paired: Robot) -> None:
    np.testing.assert_allclose(default_standing_pose(paired), default_standing_pose(robot))
    np.testing.assert_array_equal(paired.foot_bodies, robot.foot_bodies)
    np.testing.assert_array_equal(sole_friction(paired), sole_friction(robot))


def test_their_friction_varies_with_the_floors(paired: Robot) -> None:
    assert frictions(paired) == {1.0}
    assert frictions(varied(paired, Variation(friction=0.5))) == {0.5}


def test_their_friction_is_that_of_the_description(tmp_path: Path) -> None:
    pairs = [(old, new.replace('condim="3"', 'friction=".8 .8 .1 .1 .1"')) for old, new in BY_PAIRS]
    described = described_on(tmp_path, *pairs)
    for friction, expected in ((None, 0.8), (0.6, 0.6)):
        stepping = replace(described.simulation, friction=friction)
        robot = load_robot(replace(described, simulation=stepping))
        assert frictions(robot) == {expected}
        np.testing.assert_allclose(sole_friction(robot), expected)


def test_the_floor_under_them_counts_where_feet_do(paired: Robot) -> None:
    stand = default_standing_pose(paired)[None]
    assert Detector(paired, 0.01).touches(stand).floor.all()
    assert len(Detector(paired, 0.01).touches(stand).floor) == 2
    assert not Detector(paired, 0.01, feet=False).touches(stand).floor.any()
