"""A motion of Humanoid-v5 that is known in closed form at every time."""

from dataclasses import replace
from pathlib import Path

import gymnasium
import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from robojackson.motion.reference_motion import ReferenceMotion

STEPS, DT = 100, 0.015
PERIOD_S = STEPS * DT
TRAVEL = np.array([0.6, -0.2, 0.0])
"""Metres a cycle."""
YAW, SWAY, TILT = np.pi / 2, 0.3, 0.2
"""Radians."""
MJCF = Path(gymnasium.__file__).parent / "envs" / "mujoco" / "assets" / "humanoid.xml"
ROOT_HALF = np.sqrt(0.5)


def poses(time_s: np.ndarray) -> np.ndarray:
    """Return qpos: the root travels, sways about the vertical and leans; 17 hinges swing."""
    turn = 2 * np.pi * time_s / PERIOD_S
    root = np.array([0.0, 0.0, 1.3]) + time_s[:, None] / PERIOD_S * TRAVEL
    yaw, lean = YAW + SWAY * np.sin(turn), np.full(len(time_s), TILT)
    xyzw = Rotation.from_euler("ZX", np.column_stack([yaw, lean])).as_quat()
    hinges = 0.3 * np.sin(turn[:, None] + np.arange(17))
    return np.column_stack([root, xyzw[:, [3, 0, 1, 2]], hinges])


def yaw_rate(time_s: np.ndarray) -> np.ndarray:
    """Return the root's rate about the vertical, rad/s."""
    return SWAY * 2 * np.pi / PERIOD_S * np.cos(2 * np.pi * time_s / PERIOD_S)


def hinge_rates(time_s: np.ndarray) -> np.ndarray:
    turn = 2 * np.pi * time_s / PERIOD_S
    return 0.3 * 2 * np.pi / PERIOD_S * np.cos(turn[:, None] + np.arange(17))


def same_rotations(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return 1 where two quaternions are one rotation."""
    return np.abs(np.sum(a * b, axis=-1))


@pytest.fixture(scope="session")
def model() -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_path(str(MJCF))


@pytest.fixture(scope="session")
def swaying(model: mujoco.MjModel) -> ReferenceMotion:
    """Return one cycle of `poses`."""
    time_s = np.arange(STEPS) * DT
    qpos = poses(time_s)
    following = poses(time_s + 1e-6)
    qvel = np.zeros((STEPS, model.nv))
    for step in range(STEPS):
        mujoco.mj_differentiatePos(model, qvel[step], 1e-6, qpos[step], following[step])
    return ReferenceMotion(
        robot="humanoid",
        model_sha256="0" * 64,
        dt=DT,
        cyclic=True,
        cycle_offset=TRAVEL,
        qpos=qpos,
        qvel=qvel,
        body_pos_w=np.zeros((STEPS, model.nbody - 1, 3)),
        keypoints_w=np.zeros((STEPS, 14, 3)),
        contact=np.ones((STEPS, 2), int),
        torque_ratio=np.zeros((STEPS, model.nu)),
        source_time_s=time_s,
        joint_names=tuple(model.joint(index).name for index in range(1, model.njnt)),
        body_names=tuple(model.body(index).name for index in range(1, model.nbody)),
        keypoint_names=tuple(f"point_{index}" for index in range(14)),
        contact_names=("left_foot", "right_foot"),
    )


@pytest.fixture(scope="session")
def turned(swaying: ReferenceMotion) -> ReferenceMotion:
    """Return a motion upright, straight, turned 90 degrees about the vertical, at rest."""
    qpos = np.zeros_like(swaying.qpos)
    qpos[:, :7] = [0.0, 0.0, 1.3, ROOT_HALF, 0.0, 0.0, ROOT_HALF]
    still = np.zeros_like(swaying.qvel)
    return replace(swaying, qpos=qpos, qvel=still, cyclic=False, cycle_offset=np.zeros(3))
