"""The mirror image of a robot: left and right exchanged.

A robot that is symmetric about its x-z plane can do the image of whatever it can do. Hinges change
places with their partners; the sign follows from the axes: a rotation's vector turns around in a
mirror but for its part along the mirror's normal.
"""

import mujoco
import numpy as np
from jaxtyping import Float, Int

from robojackson.robot.model import Robot

ACROSS = np.array([1.0, -1.0, 1.0])
"""Of places; of rotation vectors it is the other way round."""


def hinge_partners(robot: Robot) -> tuple[Int[np.ndarray, " J"], Float[np.ndarray, " J"]]:
    """Return the hinge that takes each one's place, and the sign of its angle."""
    data = mujoco.MjData(robot.model)
    data.qpos[3] = 1.0
    mujoco.mj_kinematics(robot.model, data)
    axes = data.xaxis[1:]
    partner = partners(robot.joint_names)
    sign = np.sign(np.sum(axes * (axes[partner] * -ACROSS), 1))
    return partner, sign


def partners(names: tuple[str, ...]) -> Int[np.ndarray, " N"]:
    """Return the index of the name with left for right; its own where there is none."""
    swapped = [
        name.replace("left", "*").replace("right", "left").replace("*", "right") for name in names
    ]
    return np.array([names.index(new if new in names else old)
                     for old, new in zip(names, swapped, strict=True)])  # fmt: skip
