"""The mirror image of a robot's reference motion: left and right exchanged.

A robot that is symmetric about its x-z plane can do the image of whatever it can do. Hinges change
places with their partners; the sign follows from the axes: a rotation's vector turns around in a
mirror but for its part along the mirror's normal.
"""

from dataclasses import replace

import mujoco
import numpy as np
from jaxtyping import Float, Int

from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.robot.model import Robot

ACROSS = np.array([1.0, -1.0, 1.0])
"""Of places; of rotation vectors it is the other way round."""


def mirrored(reference: ReferenceMotion, robot: Robot) -> ReferenceMotion:
    """Return the motion in a mirror across the world's x-z plane."""
    partner, sign = hinge_partners(robot)
    qpos, qvel = np.array(reference.qpos, float), np.array(reference.qvel, float)
    for values, offset in ((qpos, 7), (qvel, 6)):
        values[:, offset:] = values[:, offset:][:, partner] * sign
        values[:, :3] *= ACROSS
    qpos[:, 3:7] *= [1.0, -1.0, 1.0, -1.0]
    qvel[:, 3:6] *= -ACROSS
    bodies = _partners(robot.body_names)
    return replace(
        reference,
        qpos=qpos,
        qvel=qvel,
        cycle_offset=reference.cycle_offset * ACROSS,
        body_pos_w=reference.body_pos_w[:, bodies] * ACROSS,
        keypoints_w=reference.keypoints_w[:, _partners(robot.keypoint_names)] * ACROSS,
        contact=reference.contact[:, _partners(robot.contact_names)],
        torque_ratio=reference.torque_ratio[:, partner],
    )


def hinge_partners(robot: Robot) -> tuple[Int[np.ndarray, " J"], Float[np.ndarray, " J"]]:
    """Return the hinge that takes each one's place, and the sign of its angle."""
    data = mujoco.MjData(robot.model)
    data.qpos[3] = 1.0
    mujoco.mj_kinematics(robot.model, data)
    axes = data.xaxis[1:]
    partner = _partners(robot.joint_names)
    sign = np.sign(np.sum(axes * (axes[partner] * -ACROSS), 1))
    return partner, sign


def _partners(names: tuple[str, ...]) -> Int[np.ndarray, " N"]:
    """Return the index of the name with left for right; its own where there is none."""
    swapped = [
        name.replace("left", "*").replace("right", "left").replace("*", "right") for name in names
    ]
    return np.array([names.index(new if new in names else old)
                     for old, new in zip(names, swapped, strict=True)])  # fmt: skip
