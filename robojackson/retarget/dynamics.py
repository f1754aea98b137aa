"""Inverse dynamics of a motion: which torques it would take, and what no contact can explain.

Contact forces at the soles are the non-negative mix of friction-pyramid edges that best explains
the wrench on the root; torques are what is left at the hinges. Newtons, newton-metres.
"""

import copy
from dataclasses import dataclass

import mujoco
import numpy as np
from jaxtyping import Float
from scipy.optimize import nnls

from robojackson.motion.smpl import AIR
from robojackson.retarget.contact import GRAVITY
from robojackson.retarget.kinematics import point_jacobian, pose, tree
from robojackson.retarget.resample import accelerations, velocities
from robojackson.retarget.robot import Robot

_EDGES = 8
_FRICTION = 1.0
_NEAR_M = 0.01  # a sole so near the floor may push even where it has no label
_TORQUE_WEIGHT = 1e-3


@dataclass(frozen=True)
class Effort:
    """Torques of the motors over their limits, and the root force that nothing explains."""

    torque_ratio: Float[np.ndarray, "S A"]
    residual_bw: Float[np.ndarray, " S"]


def effort(
    robot: Robot,
    qpos: Float[np.ndarray, "S nq"],
    contact: np.ndarray,
    dt: float,
    lap: np.ndarray | None,
) -> Effort:
    """Torque ratio of each actuated hinge (order of qpos) in each step."""
    forces = _free_space(robot, qpos, dt, lap)
    edges, active = _friction_edges(robot, qpos, contact)
    limit = np.where(robot.actuated, robot.torque_limit, 1.0)
    weight = float(robot.model.body_mass.sum()) * GRAVITY
    ratio = np.zeros((len(qpos), len(limit)))
    residual = np.zeros(len(qpos))
    for step, force in enumerate(forces):
        columns = edges[step, :, np.repeat(active[step], _EDGES)].T
        left = force - columns @ _pushes(columns, force, limit)
        ratio[step] = np.abs(left[6:]) / limit
        residual[step] = np.linalg.norm(left[:3]) / weight
    return Effort(ratio[:, robot.actuated], residual)


def _pushes(columns: np.ndarray, force: np.ndarray, limit: np.ndarray) -> np.ndarray:
    if not columns.shape[1]:
        return np.zeros(0)
    scale = np.concatenate([[1.0, 1, 1, 2, 2, 2], _TORQUE_WEIGHT / limit])
    pushes, _ = nnls(scale[:, None] * columns, scale * force)
    return np.asarray(pushes)


def _free_space(
    robot: Robot, qpos: np.ndarray, dt: float, lap: np.ndarray | None
) -> Float[np.ndarray, "S nv"]:
    """Generalised force that produces the motion with neither contacts nor limits."""
    model = copy.copy(robot.model)
    off = mujoco.mjtDisableBit.mjDSBL_CONTACT | mujoco.mjtDisableBit.mjDSBL_LIMIT
    model.opt.disableflags |= int(off)
    data = mujoco.MjData(model)
    speed, acceleration = velocities(qpos, dt, lap), accelerations(qpos, dt, lap)
    out = np.empty_like(speed)
    for step in range(len(qpos)):
        data.qpos[:], data.qvel[:], data.qacc[:] = qpos[step], speed[step], acceleration[step]
        mujoco.mj_inverse(model, data)
        out[step] = data.qfrc_inverse
    return out


def _friction_edges(
    robot: Robot, qpos: np.ndarray, contact: np.ndarray
) -> tuple[Float[np.ndarray, "S nv E"], np.ndarray]:
    """Generalised force of a unit push along each edge of each sole's friction pyramid."""
    shape = tree(robot)
    posed = pose(shape, qpos)
    ground = posed.site_pos[:, robot.contact_keypoints].copy()
    ground[..., 2] -= robot.contact_radii
    active = (contact != AIR) | (ground[..., 2] < _NEAR_M)
    angle = np.arange(_EDGES) * 2 * np.pi / _EDGES
    edges = np.stack([_FRICTION * np.cos(angle), _FRICTION * np.sin(angle), np.ones(_EDGES)])
    jacobian = point_jacobian(shape, posed, ground, robot.contact_bodies)
    force = jacobian.swapaxes(2, 3) @ edges
    return force.swapaxes(1, 2).reshape(len(qpos), force.shape[2], -1), active
