"""Torque limits of the hinges, from the motors of the MJCF or from the description. Nm."""

import mujoco
import numpy as np
from jaxtyping import Float

from robojackson.robot.description import RobotDescription
from robojackson.robot.names import matching, where


def torque_limits(
    model: mujoco.MjModel, description: RobotDescription, joints: tuple[str, ...]
) -> Float[np.ndarray, " J"]:
    """Limit of every hinge, infinite where nothing drives it; the description goes first.

    A motor gives gear times gain times control range, several of one joint together; one without a
    range, or a position or velocity servo, whatever its force range allows; the joint's own force
    range bounds all.
    """
    limit = np.full(len(joints), np.inf)
    driven = np.zeros(len(joints))
    for index in range(model.nu):
        if model.actuator_trntype[index] == int(mujoco.mjtTrn.mjTRN_JOINT):
            joint = model.actuator_trnid[index, 0]
            driven[joint - 1] += _force(model, index)
            limit[joint - 1] = min(driven[joint - 1], _own_limit(model, joint))
    for pattern, torque in description.torque_limits.items():
        place = where(description, "torque_limits")
        for name in matching("joint", pattern, joints, place):
            limit[joints.index(name)] = torque * description.gear_scale
    return limit


def _force(model: mujoco.MjModel, index: int) -> float:
    """Largest torque of one actuator."""
    gear = abs(float(model.actuator_gear[index, 0]))
    force = np.inf
    is_motor = model.actuator_biastype[index] == int(mujoco.mjtBias.mjBIAS_NONE)
    if is_motor and model.actuator_ctrllimited[index]:
        reach = np.abs(model.actuator_ctrlrange[index]).max()
        force = abs(float(model.actuator_gainprm[index, 0])) * reach
    if model.actuator_forcelimited[index]:
        force = min(force, np.abs(model.actuator_forcerange[index]).max())
    return gear * float(force)


def _own_limit(model: mujoco.MjModel, joint: int) -> float:
    if not model.jnt_actfrclimited[joint]:
        return np.inf
    return float(np.abs(model.jnt_actfrcrange[joint]).max())
