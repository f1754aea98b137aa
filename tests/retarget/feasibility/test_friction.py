"""Soles push with the friction that the robot's own feet have on its floor."""

import copy
from dataclasses import replace

import mujoco
import numpy as np
import pytest

from robojackson.retarget.feasibility import contact_wrench, inverse_dynamics, tempo
from robojackson.retarget.feasibility.contact_wrench import Tolerance
from robojackson.retarget.feasibility.inverse_dynamics import directions, sole_friction
from robojackson.robot.model import Robot
from robojackson.robot.tree_kinematics import pose, tree
from tests.fixtures.robots import robot_motion


def _with_friction(robot: Robot, sole: float, floor: float, priority: int = 0) -> Robot:
    model = copy.copy(robot.model)
    plane = model.geom_type == int(mujoco.mjtGeom.mjGEOM_PLANE)
    feet = np.isin(model.geom_bodyid, robot.contact_bodies)
    model.geom_friction[plane, 0], model.geom_friction[feet, 0] = floor, sole
    model.geom_priority[feet] = priority
    return replace(robot, model=model)


def _slack(robot: Robot) -> np.ndarray:
    motion = robot_motion("walk")
    offset = motion.cycle_offset if motion.cyclic else None
    return tempo.slacks(robot, motion.qpos, motion.dt, offset, Tolerance(), tempo.GRID[:1])[0]


def test_the_stock_robots_friction_is_that_of_its_mjcf(robot: Robot):
    np.testing.assert_array_equal(sole_friction(robot), 1.0)


@pytest.mark.parametrize(
    ("sole", "floor", "priority", "expected"),
    [(0.4, 0.2, 0, 0.4), (0.2, 0.6, 0, 0.6), (0.2, 0.6, 1, 0.2)],
)
def test_geoms_pair_as_in_mujoco(sole, floor, priority, expected, robot: Robot):
    other = _with_friction(robot, sole, floor, priority)
    np.testing.assert_allclose(sole_friction(other), expected)
    assert np.abs(directions(other)[:, :2]).max() == pytest.approx(expected)


def test_a_walk_cannot_be_walked_on_ice(robot: Robot):
    icy = _with_friction(robot, 0.02, 0.02)
    assert np.mean(_slack(icy) > 1.0) > np.mean(_slack(robot) > 1.0) + 0.2


def test_no_push_leaves_the_cone(robot: Robot):
    other, motion = _with_friction(robot, 0.3, 0.3), robot_motion("walk")
    posed = pose(tree(other), motion.qpos)
    force = inverse_dynamics.free_space(other, motion.qpos, motion.dt, motion.cycle_offset).at(1.0)
    near = inverse_dynamics.touching(other, posed)
    demand = inverse_dynamics.demand(other, motion.qpos, force, near, Tolerance())
    pushes = contact_wrench.supply(demand).pushes.reshape(len(force), len(near[0]), -1)
    push = np.einsum("cxe,sce->scx", directions(other), pushes)
    along, up = np.linalg.norm(push[..., :2], axis=-1), push[..., 2]
    assert (along <= 0.3 * up + 1e-9).all()
