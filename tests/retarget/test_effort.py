"""Inverse dynamics knows a stand from a levitation."""

import mujoco
import numpy as np
import pytest

from robojackson.motion.smpl import AIR, PLANTED
from robojackson.retarget import Robot
from robojackson.retarget.dynamics import effort


def _still(robot: Robot, height: float) -> np.ndarray:
    qpos = np.tile(robot.standing, (6, 1))
    qpos[:, 2] += height
    return qpos


def test_a_levitating_body_needs_its_weight_from_nowhere(robot: Robot):
    loads = effort(robot, _still(robot, 1.0), np.full((6, 2), AIR), 0.015, None)
    np.testing.assert_allclose(loads.residual_bw, 1.0, atol=1e-6)


def test_a_falling_body_needs_nothing(robot: Robot):
    qpos, time = _still(robot, 5.0), np.arange(6) * 0.015
    qpos[:, 2] -= 4.905 * time**2
    loads = effort(robot, qpos, np.full((6, 2), AIR), 0.015, None)
    np.testing.assert_allclose(loads.residual_bw, 0.0, atol=1e-6)


def test_planted_feet_carry_the_weight(robot: Robot):
    loads = effort(robot, _still(robot, -0.11), np.full((6, 2), PLANTED), 0.015, None)
    assert loads.residual_bw.max() < 0.1


def test_an_arm_held_out_costs_what_gravity_asks(robot: Robot):
    """Shoulder torque of the forearm and upper arm about the hinge, from masses and levers."""
    qpos = _still(robot, 1.0)
    loads = effort(robot, qpos, np.full((6, 2), AIR), 0.015, None)
    data = mujoco.MjData(robot.model)
    data.qpos[:] = qpos[0]
    mujoco.mj_forward(robot.model, data)
    joint = robot.model.joint("left_shoulder1").id
    torque = np.zeros(3)
    for name in ("left_upper_arm", "left_lower_arm"):
        body = robot.model.body(name).id
        weight = np.array([0.0, 0.0, -9.81 * robot.model.body_mass[body]])
        torque += np.cross(data.xipos[body] - data.xanchor[joint], weight)
    expected = abs(torque @ data.xaxis[joint]) / 10.0
    column = robot.joint_names.index("left_shoulder1")
    assert loads.torque_ratio[2, column] == pytest.approx(expected, abs=0.02)
