"""Inverse dynamics of a motion: the force needed in free space, and what soles and motors supply.

The force of a motion at another tempo k follows from two evaluations: gravity and springs do not
change, damping goes with k, inertia and Coriolis with k^2. Soles push along the edges of friction
pyramids, with the friction of the robot's own feet on its floor. Newtons, newton-metres.
"""

from dataclasses import dataclass

import mujoco
import numpy as np
from jaxtyping import Bool, Float

from robojackson.retarget.feasibility.contact_wrench import Demand, Tolerance
from robojackson.retarget.feasibility.force_model import once_a_robot, unconstrained
from robojackson.retarget.targets.ground_contact import GRAVITY
from robojackson.robot.body_states import own_mass, solid_geoms
from robojackson.robot.model import Robot
from robojackson.robot.resampling import accelerations, velocities
from robojackson.robot.tree_kinematics import Posed, pose, tree

_EDGES = 8
_FRICTION = 1.0  # MuJoCo's default, of a foot without geoms
NEAR_M = 0.02
"""A sole below this height may push, metres."""
_STOP_RAD = 0.01  # so near to a limit of its range a hinge rests on its stop


linkage = once_a_robot(tree)
"""The constants of the robot's tree."""


@dataclass(frozen=True)
class FreeSpace:
    """Generalised force that produces a motion without contacts and stops, by its parts."""

    still: Float[np.ndarray, "S nv"]
    damped: Float[np.ndarray, "S nv"]
    inertial: Float[np.ndarray, "S nv"]

    def at(self, tempo: float | Float[np.ndarray, " S"]) -> Float[np.ndarray, "S nv"]:
        """Return the force at a tempo beside the motion's own, one for all steps or one a step."""
        k = np.broadcast_to(np.asarray(tempo, float), len(self.still))[:, None]
        return np.asarray(self.still + k * self.damped + k**2 * self.inertial)


def body_weight(robot: Robot) -> float:
    """Return the weight of the robot, newtons."""
    return float(own_mass(robot.model).sum()) * GRAVITY


def free_space(
    robot: Robot, qpos: Float[np.ndarray, "S nq"], dt: float, cycle_offset: np.ndarray | None
) -> FreeSpace:
    """Return the force of a motion, by its parts."""
    model = unconstrained(robot)
    speed, acceleration = velocities(qpos, dt, cycle_offset), accelerations(qpos, dt, cycle_offset)
    whole = inverse(model, qpos, speed, acceleration)
    still = inverse(model, qpos, np.zeros_like(speed), np.zeros_like(speed))
    damped = model.dof_damping * speed
    return FreeSpace(still, damped, whole - still - damped)


def inverse(
    model: mujoco.MjModel, qpos: np.ndarray, speed: np.ndarray, acceleration: np.ndarray
) -> Float[np.ndarray, "S nv"]:
    """Return `mj_inverse` of every step."""
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
    posed: Posed | None = None,
) -> Demand:
    """Return the force that a motion needs from the touching soles and the motors.

    Args:
        posed: The kinematics, where they are known.
    """
    posed = pose(linkage(robot), qpos) if posed is None else posed
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
    feet, spread = wrenches(robot, posed)
    return Demand(force, feet, weight * spread, usable, lower, upper, scale, ease)


def sole_points(robot: Robot, posed: Posed) -> Float[np.ndarray, "S C 3"]:
    """Return the lowest points of the balls under the feet."""
    ground = posed.ball_pos.copy()
    ground[..., 2] -= robot.contact_radii
    return np.asarray(ground)


def touching(robot: Robot, posed: Posed) -> Bool[np.ndarray, "S C"]:
    """Return the soles near the floor, for any labels."""
    return np.asarray(sole_points(robot, posed)[..., 2] < NEAR_M)


def wrenches(
    robot: Robot, posed: Posed
) -> tuple[Float[np.ndarray, "S nv W"], Float[np.ndarray, "S W E"]]:
    """Return the generalised force of a unit wrench at each foot (about the middle of its soles,
    moments first), and the wrenches of a unit push along each edge of each sole's friction pyramid.
    """
    points, count = sole_points(robot, posed), len(posed.axis)
    bodies, foot = np.unique(robot.contact_bodies, return_inverse=True)
    along = directions(robot)
    axis, moment = posed.screws
    moved = linkage(robot).moved_by[bodies]
    feet = np.zeros((count, moved.shape[1], len(bodies), 6))
    spread = np.zeros((count, len(bodies), 6, len(foot), _EDGES))
    for index in range(len(bodies)):
        own = np.flatnonzero(foot == index)
        middle = points[:, own].mean(axis=1)
        shift = moment + np.cross(axis, middle[:, :, None], axis=1)
        feet[:, :, index] = np.concatenate([axis, shift], axis=1).swapaxes(1, 2)
        feet[:, :, index] *= moved[index][:, None]
        for sole in own:
            arm = points[:, sole] - middle
            spread[:, index, :3, sole] = np.cross(arm[:, :, None], along[None, sole], axis=1)
            spread[:, index, 3:, sole] = along[sole]
    return (
        feet.reshape(count, -1, 6 * len(bodies)),
        spread.reshape(count, 6 * len(bodies), -1),
    )


@once_a_robot
def directions(robot: Robot) -> Float[np.ndarray, "C 3 E"]:
    """Return the edges of each sole's friction pyramid, upward part 1."""
    angle = np.arange(_EDGES) * 2 * np.pi / _EDGES
    flat = sole_friction(robot)[:, None, None] * np.stack([np.cos(angle), np.sin(angle)])
    return np.concatenate([flat, np.ones((len(flat), 1, _EDGES))], axis=1)


@once_a_robot
def sole_friction(robot: Robot) -> Float[np.ndarray, " C"]:
    """Return the sliding friction of each sole on the floor, as MuJoCo pairs geoms: that of their
    pair, else the larger of the two, or that of the one with the higher priority. Of a foot's geoms
    the most slippery counts."""
    model = robot.model
    touches = solid_geoms(model)
    plane = model.geom_type == int(mujoco.mjtGeom.mjGEOM_PLANE)
    floor = np.flatnonzero(plane & touches)
    found = np.empty(len(robot.contact_bodies))
    for index, body in enumerate(robot.contact_bodies):
        on_foot = model.body_weldid[model.geom_bodyid] == model.body_weldid[body]
        pairs = [
            _pair_friction(model, int(foot), int(ground))
            for foot in np.flatnonzero(on_foot & touches)
            for ground in floor
        ]
        found[index] = min(pairs, default=_FRICTION)
    return found


def _pair_friction(model: mujoco.MjModel, first: int, second: int) -> float:
    one, other = model.pair_geom1, model.pair_geom2
    is_own = ((one == first) & (other == second)) | ((one == second) & (other == first))
    own = np.flatnonzero(is_own)
    if len(own):
        return float(model.pair_friction[own[0], 0])
    rank, slides = model.geom_priority, model.geom_friction[:, 0]
    if rank[first] != rank[second]:
        return float(slides[first if rank[first] > rank[second] else second])
    return float(max(slides[first], slides[second]))
