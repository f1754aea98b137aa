"""Inverse dynamics of a motion: what it asks for in free space, and what soles and motors can give.

The force of a motion at another tempo k follows from two evaluations: gravity and springs do not
change, damping goes with k, inertia and Coriolis with k^2. Newtons, newton-metres.
"""

import copy
from dataclasses import dataclass

import mujoco
import numpy as np
from jaxtyping import Bool, Float

from robojackson.retarget.feasibility.contact_wrench import Demand, Tolerance
from robojackson.retarget.targets.ground_contact import GRAVITY
from robojackson.robot.model import Robot
from robojackson.robot.resampling import accelerations, velocities
from robojackson.robot.tree_kinematics import Posed, point_jacobian, pose, tree

_EDGES = 8
_FRICTION = 1.0
NEAR_M = 0.02
"""A sole below this height may push, metres."""
_STOP_RAD = 0.01  # so near to a limit of its range a hinge rests on its stop


@dataclass(frozen=True)
class FreeSpace:
    """Generalised force that produces a motion without contacts and stops, by its parts."""

    still: Float[np.ndarray, "S nv"]
    damped: Float[np.ndarray, "S nv"]
    inertial: Float[np.ndarray, "S nv"]

    def at(self, tempo: float | Float[np.ndarray, " S"]) -> Float[np.ndarray, "S nv"]:
        """The force at a tempo beside the motion's own, one for all steps or one a step."""
        k = np.broadcast_to(np.asarray(tempo, float), len(self.still))[:, None]
        return np.asarray(self.still + k * self.damped + k**2 * self.inertial)


def body_weight(robot: Robot) -> float:
    """Newtons."""
    return float(robot.model.body_mass.sum()) * GRAVITY


def free_space(
    robot: Robot, qpos: Float[np.ndarray, "S nq"], dt: float, cycle_offset: np.ndarray | None
) -> FreeSpace:
    """The force of a motion, by its parts."""
    model = unconstrained(robot)
    speed, acceleration = velocities(qpos, dt, cycle_offset), accelerations(qpos, dt, cycle_offset)
    whole = inverse(model, qpos, speed, acceleration)
    still = inverse(model, qpos, np.zeros_like(speed), np.zeros_like(speed))
    damped = model.dof_damping * speed
    return FreeSpace(still, damped, whole - still - damped)


def unconstrained(robot: Robot) -> mujoco.MjModel:
    """The robot's model without contacts and stops."""
    model = copy.copy(robot.model)
    off = mujoco.mjtDisableBit.mjDSBL_CONTACT | mujoco.mjtDisableBit.mjDSBL_LIMIT
    model.opt.disableflags |= int(off)
    model.opt.integrator = int(mujoco.mjtIntegrator.mjINT_IMPLICITFAST)  # RK4 has no derivatives
    return model


def inverse(
    model: mujoco.MjModel, qpos: np.ndarray, speed: np.ndarray, acceleration: np.ndarray
) -> Float[np.ndarray, "S nv"]:
    """`mj_inverse` of every step."""
    data = mujoco.MjData(model)
    out = np.empty_like(speed)
    for step in range(len(qpos)):
        data.qpos[:], data.qvel[:], data.qacc[:] = qpos[step], speed[step], acceleration[step]
        mujoco.mj_inverse(model, data)
        out[step] = data.qfrc_inverse
    return out


def demand(
    robot: Robot,
    qpos: Float[np.ndarray, "S nq"],
    force: Float[np.ndarray, "S nv"],
    touching: Bool[np.ndarray, "S C"],
    tolerance: Tolerance,
) -> Demand:
    """What a motion asks for beside what the touching soles and the motors may give."""
    posed = pose(tree(robot), qpos)
    limit = np.where(robot.actuated, robot.torque_limit, np.inf)
    lower, upper = np.tile(-limit, (len(qpos), 1)), np.tile(limit, (len(qpos), 1))
    upper[qpos[:, 7:] < robot.lower + _STOP_RAD] = np.inf
    lower[qpos[:, 7:] > robot.upper - _STOP_RAD] = -np.inf
    weight = body_weight(robot)
    scale = np.ones(force.shape[1])
    scale[:3] = 1.0 / (tolerance.force_bw * weight)
    scale[3:6] = 1.0 / (tolerance.lever_m * weight)
    ease = np.where(robot.actuated, 1.0 / np.where(robot.actuated, robot.torque_limit, 1.0), 0.0)
    scale[6:] = ease / tolerance.torque
    usable = np.repeat(touching, _EDGES, axis=1)
    return Demand(force, weight * edges(robot, posed), usable, lower, upper, scale, ease)


def sole_points(robot: Robot, posed: Posed) -> Float[np.ndarray, "S C 3"]:
    """Lowest points of the balls under the feet."""
    ground = posed.ball_pos.copy()
    ground[..., 2] -= robot.contact_radii
    return np.asarray(ground)


def touching(robot: Robot, qpos: Float[np.ndarray, "S nq"]) -> Bool[np.ndarray, "S C"]:
    """Soles near the floor, whatever their labels."""
    return np.asarray(sole_points(robot, pose(tree(robot), qpos))[..., 2] < NEAR_M)


def edges(robot: Robot, posed: Posed) -> Float[np.ndarray, "S nv E"]:
    """Generalised force of a unit push along each edge of each sole's friction pyramid."""
    shape = tree(robot)
    jacobian = point_jacobian(shape, posed, sole_points(robot, posed), robot.contact_bodies)
    force = jacobian.swapaxes(2, 3) @ directions()
    return np.asarray(force.swapaxes(1, 2).reshape(len(force), force.shape[2], -1))


def directions() -> Float[np.ndarray, "3 E"]:
    """The edges of a friction pyramid, upward part 1."""
    angle = np.arange(_EDGES) * 2 * np.pi / _EDGES
    return np.stack([_FRICTION * np.cos(angle), _FRICTION * np.sin(angle), np.ones(_EDGES)])
