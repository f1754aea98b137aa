"""Torque limits, gains and action scales of the hinges, from the description or from the MJCF.

A motor's number in the description goes before that of the MJCF. Nm, radians, seconds.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import mujoco
import numpy as np
from jaxtyping import Float

from robojackson.errors import BadConfiguration
from robojackson.robot.description import RobotDescription
from robojackson.robot.names import matching, where

STIFFNESS_OF_LIMIT = 4.0
"""Proportional gain where the description names none, multiples of the torque limit, 1/rad."""
DAMPING_OF_STIFFNESS = 0.1
"""Derivative gain where the description names none, multiples of the proportional one, s."""
DAMPING_RATIO = 2.0
ACTION_SCALE_RAD = 0.5


@dataclass(frozen=True)
class Actuation:
    """Drives of the hinges, in the order of qpos.

    Attributes:
        torque_limit: Nm; infinite without a motor.
        speed_limit: Of the motors, rad/s.
        motion_speed: Largest speed in a reference motion, rad/s: the description's limit for all
            hinges, or that of its own motor where that is lower.
        stiffness: Proportional gain, Nm/rad; infinite without a motor.
        damping: Derivative gain, Nm s/rad.
        action_scale: How far a full action moves a hinge's target, rad.
    """

    torque_limit: Float[np.ndarray, " J"]
    speed_limit: Float[np.ndarray, " J"]
    motion_speed: Float[np.ndarray, " J"]
    stiffness: Float[np.ndarray, " J"]
    damping: Float[np.ndarray, " J"]
    action_scale: Float[np.ndarray, " J"]


def actuation_of(
    model: mujoco.MjModel, description: RobotDescription, joints: tuple[str, ...]
) -> Actuation:
    """Bind the numbers of the description to the hinges of a compiled model.

    Gains are those that are named; else those of the natural frequency f and damping ratio z of
    the PD law with the hinge's armature I, kp = I (2 pi f)^2 and kd = 2 z sqrt(I kp) (BeyondMimic,
    2025, appendix); else multiples of the torque limit. A damping ratio holds for any kp.

    Raises:
        UnknownName: a hinge or pattern that matches none.
        BadConfiguration: a natural frequency or a damping ratio of a hinge without armature.
    """

    def named(key: str) -> Float[np.ndarray, " J"]:
        return per_hinge(getattr(description, key), joints, where(description, key))

    limit = torque_limits(model, description, joints)
    armature = model.dof_armature[6:]
    turns, ratio = 2 * np.pi * named("natural_frequency"), named("damping_ratio")
    given = {"stiffness": named("stiffness"), "damping": named("damping")}
    for key, needs, gain in (
        ("natural_frequency", turns, given["stiffness"]),
        ("damping_ratio", ratio, given["damping"]),
    ):
        for joint in np.flatnonzero((needs > 0) & (armature == 0) & np.isnan(gain)):
            raise BadConfiguration(
                f"{where(description, key)}: {joints[joint]} has no armature, so that its gains "
                "would be zero; name its armature, or its stiffness and damping"
            )
    ratio = np.where(np.isnan(ratio) & (turns > 0), DAMPING_RATIO, ratio)
    stiffness = _first(given["stiffness"], armature * turns**2, STIFFNESS_OF_LIMIT * limit)
    driven = np.where(np.isfinite(stiffness), stiffness, np.nan)
    damping = _first(
        given["damping"],
        2 * ratio * np.sqrt(armature * driven),
        DAMPING_OF_STIFFNESS * stiffness,
    )
    scale = named("action_scale")
    speed = named("speed_limits")
    return Actuation(
        torque_limit=limit,
        speed_limit=_first(speed, np.full(len(joints), description.max_joint_speed)),
        motion_speed=np.fmin(speed, description.max_joint_speed),
        stiffness=stiffness,
        damping=damping,
        action_scale=np.where(np.isnan(scale), ACTION_SCALE_RAD, scale),
    )


def per_hinge(
    named: Mapping[str, float], joints: tuple[str, ...], place: str
) -> Float[np.ndarray, " J"]:
    """Return the values of patterns a hinge, NaN where none matches; the last that matches counts.

    Raises:
        UnknownName: a pattern that matches no hinge.
    """
    values = np.full(len(joints), np.nan)
    for pattern, value in named.items():
        for name in matching("joint", pattern, joints, place):
            values[joints.index(name)] = value
    return values


def _first(*choices: Float[np.ndarray, " J"]) -> Float[np.ndarray, " J"]:
    """Return the first that is a number, hinge by hinge."""
    result = choices[0]
    for choice in choices[1:]:
        result = np.where(np.isnan(result), choice, result)
    return result


def torque_limits(
    model: mujoco.MjModel, description: RobotDescription, joints: tuple[str, ...]
) -> Float[np.ndarray, " J"]:
    """Return the limit of every hinge, infinite where nothing drives it; the description takes
    precedence.

    A motor gives gear times gain times control range, several of one joint together; one without a
    range, or a position or velocity servo, what its force range allows; the joint's own force
    range bounds all. Of a force range that differs in direction the smaller side counts.
    """
    limit = np.full(len(joints), np.inf)
    driven = np.zeros(len(joints))
    for index in range(model.nu):
        if model.actuator_trntype[index] == int(mujoco.mjtTrn.mjTRN_JOINT):
            joint = model.actuator_trnid[index, 0]
            driven[joint - 1] += motor_torque(model, index)
            limit[joint - 1] = min(driven[joint - 1], joint_torque(model, joint))
    place = where(description, "torque_limits")
    named = per_hinge(description.torque_limits, joints, place) * description.gear_scale
    return np.where(np.isnan(named), limit, named)


def motor_torque(model: mujoco.MjModel, index: int) -> float:
    """Return the largest torque of one actuator, Nm; infinite without a range."""
    gear = abs(float(model.actuator_gear[index, 0]))
    force = np.inf
    is_motor = model.actuator_biastype[index] == int(mujoco.mjtBias.mjBIAS_NONE)
    if is_motor and model.actuator_ctrllimited[index]:
        reach = np.abs(model.actuator_ctrlrange[index]).max()
        force = abs(float(model.actuator_gainprm[index, 0])) * reach
    if model.actuator_forcelimited[index]:
        force = min(force, both_ways(model.actuator_forcerange[index]))
    return gear * float(force)


def joint_torque(model: mujoco.MjModel, joint: int) -> float:
    """Return the bound that a joint has itself on the torque of its actuators, Nm."""
    if not model.jnt_actfrclimited[joint]:
        return np.inf
    return both_ways(model.jnt_actfrcrange[joint])


def both_ways(force_range: Float[np.ndarray, "2"]) -> float:
    """Return the largest force that a range allows in both directions; where it allows one
    direction alone, the largest in that."""
    low, high = (float(force) for force in force_range)
    smaller = min(-low, high)
    return smaller if smaller > 0 else max(-low, high)
