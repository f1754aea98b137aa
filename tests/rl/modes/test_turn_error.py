"""Laws of the error of the bodies' orientations: MuJoCo's, and a rotation's angle."""

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from robojackson.geometry.rotations import from_rotation, quat_angle, quat_multiply
from robojackson.rl.modes.rewards import turn_error
from robojackson.robot.model import Robot
from robojackson.robot.tree_kinematics import tree


@pytest.fixture
def qpos(robot: Robot) -> np.ndarray:
    """Return random poses."""
    found = np.random.default_rng(4).normal(0.0, 0.5, (3, robot.model.nq))
    found[:, 3:7] /= np.linalg.norm(found[:, 3:7], axis=1, keepdims=True)
    return found


def turns(robot: Robot, qpos: np.ndarray) -> np.ndarray:
    """Return MuJoCo's orientations of the bodies that hinges move."""
    data = mujoco.MjData(robot.model)
    data.qpos[:] = qpos
    mujoco.mj_kinematics(robot.model, data)
    return np.array(data.xquat[np.unique(robot.model.jnt_bodyid[1:])])


def test_orientations_are_those_of_mujoco(robot: Robot, qpos: np.ndarray) -> None:
    aim = qpos[[1, 2, 0]]
    angles = [quat_angle(turns(robot, a), turns(robot, b)) for a, b in zip(qpos, aim, strict=True)]
    expected = np.sqrt(np.mean(np.square(angles), axis=1))
    np.testing.assert_allclose(turn_error(tree(robot), qpos, aim), expected, atol=1e-6)


def test_the_error_of_a_turned_body_is_the_angle(robot: Robot, qpos: np.ndarray) -> None:
    turned = qpos.copy()
    turn = from_rotation(Rotation.from_rotvec([[0.1, 0.2, -0.2]]))
    turned[:, 3:7] = quat_multiply(np.repeat(turn, 3, 0), qpos[:, 3:7])
    np.testing.assert_allclose(turn_error(tree(robot), turned, qpos), 0.3, atol=1e-6)
    np.testing.assert_allclose(turn_error(tree(robot), qpos, qpos), 0.0, atol=1e-6)


def test_a_hinge_turns_the_bodies_after_it_alone(robot: Robot, qpos: np.ndarray) -> None:
    bent = qpos.copy()
    bent[:, 7:][:, robot.joint_names.index("right_elbow")] += 0.4
    bodies = len(np.unique(robot.model.jnt_bodyid[1:]))
    error = turn_error(tree(robot), bent, qpos)
    np.testing.assert_allclose(error, 0.4 / np.sqrt(bodies), atol=1e-6)
