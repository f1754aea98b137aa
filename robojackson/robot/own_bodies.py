"""Which bodies of a model are the robot's: those that its free joint carries.

A stage, a box or a marker beside it is fixed to the world, and is part of that. Kilograms.
"""

import mujoco
import numpy as np
from jaxtyping import Bool, Float


def own_bodies(model: mujoco.MjModel) -> Bool[np.ndarray, " B"]:
    """Return whether each body is the robot's; the free joint is the first."""
    result: np.ndarray = model.body_rootid == model.jnt_bodyid[0]
    return result


def own_mass(model: mujoco.MjModel) -> Float[np.ndarray, " B"]:
    """Return the mass of each body of the robot, zero of the others, kg."""
    result: np.ndarray = np.where(own_bodies(model), model.body_mass, 0.0)
    return result


def fixed_bodies(model: mujoco.MjModel) -> Bool[np.ndarray, " B"]:
    """Return whether each body is the world or fixed to it."""
    result: np.ndarray = model.body_weldid == 0
    return result
