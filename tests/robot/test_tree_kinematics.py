"""Our batched kinematics are MuJoCo's."""

import mujoco
import numpy as np

from robojackson.robot.model import Robot
from robojackson.robot.tree_kinematics import (
    above,
    centre_of_mass,
    com_jacobian,
    difference,
    integrate,
    point_jacobian,
    pose,
    tree,
)


def test_bodies_and_sites_are_where_mujoco_puts_them(robot: Robot, poses: np.ndarray):
    posed, data = pose(tree(robot), poses), mujoco.MjData(robot.model)
    for index, qpos in enumerate(poses):
        data.qpos[:] = qpos
        mujoco.mj_kinematics(robot.model, data)
        np.testing.assert_allclose(posed.body_pos[index], data.xpos, atol=1e-12)
        sites = data.site_xpos[robot.keypoint_sites]
        np.testing.assert_allclose(posed.site_pos[index], sites, atol=1e-12)


def test_the_point_jacobian_is_mj_jac(robot: Robot, poses: np.ndarray, rng: np.random.Generator):
    shape = tree(robot)
    posed, data = pose(shape, poses), mujoco.MjData(robot.model)
    bodies = np.arange(robot.model.nbody)
    points = rng.normal(size=(len(poses), len(bodies), 3))
    ours = point_jacobian(shape, posed, points, bodies)
    expected = np.zeros((3, robot.model.nv))
    for index, qpos in enumerate(poses):
        data.qpos[:] = qpos
        mujoco.mj_kinematics(robot.model, data)
        mujoco.mj_comPos(robot.model, data)
        for body in bodies:
            mujoco.mj_jac(robot.model, data, expected, None, points[index, body], body)
            np.testing.assert_allclose(ours[index, body], expected, atol=1e-12)


def test_legs_alone_are_where_the_whole_robot_has_them(robot: Robot, poses: np.ndarray) -> None:
    own, feet = tree(robot), robot.contact_bodies
    legs = above(own, feet)
    assert len(legs) < len(own.parent) - 1
    whole, part = pose(own, poses), pose(own, poses, legs)
    np.testing.assert_array_equal(part.ball_pos, whole.ball_pos)
    found = [point_jacobian(own, at, whole.ball_pos, feet) for at in (whole, part)]
    np.testing.assert_array_equal(*found)


def test_the_centre_of_mass_and_its_jacobian_are_mujocos(robot: Robot, poses: np.ndarray):
    shape = tree(robot)
    posed, data = pose(shape, poses), mujoco.MjData(robot.model)
    com, jacobian = centre_of_mass(shape, posed), com_jacobian(shape, posed)
    expected = np.zeros((3, robot.model.nv))
    for index, qpos in enumerate(poses):
        data.qpos[:] = qpos
        mujoco.mj_kinematics(robot.model, data)
        mujoco.mj_comPos(robot.model, data)
        mujoco.mj_jacSubtreeCom(robot.model, data, expected, 0)
        np.testing.assert_allclose(com[index], data.subtree_com[0], atol=1e-12)
        np.testing.assert_allclose(jacobian[index], expected, atol=1e-12)


def test_integration_is_mj_integrate_pos(robot: Robot, poses: np.ndarray, rng: np.random.Generator):
    tangent = rng.normal(size=(len(poses), robot.model.nv))
    ours = integrate(poses, tangent)
    for index, qpos in enumerate(poses):
        expected = qpos.copy()
        mujoco.mj_integratePos(robot.model, expected, tangent[index], 1.0)
        np.testing.assert_allclose(ours[index], expected, atol=1e-12)


def test_difference_undoes_integration(robot: Robot, poses: np.ndarray, rng: np.random.Generator):
    tangent = rng.uniform(-1, 1, (len(poses), robot.model.nv))
    np.testing.assert_allclose(difference(poses, integrate(poses, tangent)), tangent, atol=1e-9)
