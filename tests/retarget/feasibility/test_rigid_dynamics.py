"""Analytic inverse dynamics is MuJoCo's, on robots with balls for feet and with ankles."""

from pathlib import Path

import mujoco
import numpy as np
import pytest

from robojackson.retarget.feasibility.force_model import force_model, unconstrained
from robojackson.retarget.feasibility.inverse_dynamics import inverse
from robojackson.retarget.feasibility.rigid_dynamics import Slopes, dynamics
from robojackson.robot.model import Robot, load_robot
from robojackson.robot.tree_kinematics import pose, tree
from tests.fixtures import machine
from tests.fixtures.robots import stock

STEPS = 5


@pytest.fixture(params=["stock", "machine"])
def any_robot(request: pytest.FixtureRequest, tmp_path: Path) -> Robot:
    return stock() if request.param == "stock" else load_robot(machine.description(tmp_path))


def _moving(robot: Robot) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return poses, velocities and accelerations away from the origin, turned and fast."""
    rng = np.random.default_rng(4)
    qpos = np.tile(robot.standing, (STEPS, 1))
    qpos[:, :3] = rng.normal(size=(STEPS, 3))
    turn = rng.normal(size=(STEPS, 4))
    qpos[:, 3:7] = turn / np.linalg.norm(turn, axis=1, keepdims=True)
    qpos[:, 7:] = rng.uniform(robot.lower, robot.upper, (STEPS, len(robot.lower)))
    speed, rate = 3.0 * rng.normal(size=(2, STEPS, robot.model.nv))
    return qpos, speed, 10.0 * rate


def _found(robot: Robot, qpos: np.ndarray, speed: np.ndarray, rate: np.ndarray) -> Slopes:
    return dynamics(force_model(robot), pose(tree(robot), qpos), qpos[:, 7:], speed, rate).slopes()


def test_the_force_is_mujocos(any_robot: Robot):
    moving = _moving(any_robot)
    expected = inverse(unconstrained(any_robot), *moving)
    np.testing.assert_allclose(_found(any_robot, *moving).force, expected, rtol=1e-9, atol=1e-8)


def test_its_derivatives_are_mujocos_finite_differences(any_robot: Robot):
    qpos, speed, rate = _moving(any_robot)
    found, model = _found(any_robot, qpos, speed, rate), unconstrained(any_robot)
    data, count = mujoco.MjData(model), model.nv
    for step in range(STEPS):
        data.qpos[:], data.qvel[:], data.qacc[:] = qpos[step], speed[step], rate[step]
        mujoco.mj_inverse(model, data)
        p, v, a = np.zeros((3, count, count))
        mujoco.mjd_inverseFD(model, data, 1e-6, False, p, v, a, None, None, None, None)
        for mine, theirs in ((found.position, p), (found.velocity, v), (found.acceleration, a)):
            gap = np.abs(mine[step] - theirs.T).max()
            assert gap < 2e-5 * max(1.0, np.abs(theirs).max())


def test_many_steps_are_as_each_by_itself():
    robot = stock()
    many = [np.tile(part, (60, 1)) for part in _moving(robot)]
    few = _found(robot, *_moving(robot))
    found = _found(robot, *many)
    np.testing.assert_allclose(found.position[-STEPS:], few.position, atol=1e-9)
    np.testing.assert_allclose(found.force[-STEPS:], few.force, atol=1e-9)
