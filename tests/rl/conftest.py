"""A robot and a short cyclic reference motion, made here from joint curves."""

from collections.abc import Callable

import mujoco
import numpy as np
import pytest

from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.pipeline.yaml_loader import load
from robojackson.robot.model import Robot, RobotDescription, load_robot
from tests.fixtures.robot_motions import motion_of

DT = 0.015


@pytest.fixture(scope="session")
def robot() -> Robot:
    return load_robot(load(RobotDescription, "robots/humanoid"))


@pytest.fixture(scope="session")
def sway(robot: Robot) -> ReferenceMotion:
    """Return 1.2 s of knee bends and light arms, feet on the floor, exactly cyclic."""
    return make_reference(robot, sway_angles)


def sway_angles(phase: np.ndarray) -> dict[str, np.ndarray]:
    wave = np.sin(phase)
    return {
        "left_knee": -0.5 + 0.2 * wave,
        "right_knee": -0.5 - 0.2 * wave,
        "left_hip_y": -0.25 + 0.1 * wave,
        "right_hip_y": -0.25 - 0.1 * wave,
        "left_shoulder1": -0.3 + 0.3 * wave,
        "right_shoulder1": 0.3 + 0.3 * wave,
        "left_elbow": -0.8 + 0.2 * np.cos(phase),
        "right_elbow": -0.8 - 0.2 * np.cos(phase),
    }


def make_reference(
    robot: Robot, angles: Callable[[np.ndarray], dict[str, np.ndarray]], cyclic: bool = True
) -> ReferenceMotion:
    model, steps = robot.model, 80
    data = mujoco.MjData(model)
    qpos = np.tile(model.qpos0, (steps, 1))
    for name, curve in angles(2 * np.pi * np.arange(steps) / steps).items():
        qpos[:, model.joint(name).qposadr[0]] = curve
    for t in range(steps):
        data.qpos[:] = qpos[t]
        mujoco.mj_kinematics(model, data)
        feet = data.site_xpos[robot.keypoint_sites][robot.contact_keypoints]
        qpos[t, 2] -= (feet[:, 2] - robot.contact_radii).min()
    return motion_of(robot, qpos, DT, cyclic)
