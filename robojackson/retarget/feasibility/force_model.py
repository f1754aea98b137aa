"""Constants of a robot for inverse dynamics, computed once a robot.

Copying a model with meshes costs as much as the dynamics of a thousand steps, so what is derived of
a robot is cached by its identity. Kilograms, metres, radians, newton-metres.
"""

import copy
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache, wraps
from typing import TypeVar

import mujoco
import numpy as np
from jaxtyping import Float, Int

from robojackson.geometry.rotations import quat_to_matrix
from robojackson.robot.model import Robot

_CACHED_ROBOTS = 4
_T = TypeVar("_T")


@dataclass(frozen=True)
class ForceModel:
    """Constants of the tree.

    Attributes:
        bodies: Bodies that move and have mass, and of each:
        last_dof: The lowest degree of freedom that moves it,
        mass, com, inertia: about the centre of mass, in the frame of the body.
        parent: Parent of each dof: the lowest one above it; the root's six are two joints of three,
            which no other precedes.
        above: 1 where dof i (row) moves dof j (column), or is of its joint.
        below: 1 where j is moved by i, and i is not of its joint; `upper` both or itself.
        carried_mass: Mass of all bodies that a dof moves.
        stiffness, spring, damping, armature: Parameters of the dofs; `spring` of the hinges.
        gravity: m/s2.
    """

    bodies: Int[np.ndarray, " B"]
    last_dof: Int[np.ndarray, " B"]
    mass: Float[np.ndarray, " B"]
    com: Float[np.ndarray, "B 3"]
    inertia: Float[np.ndarray, "B 3 3"]
    parent: Int[np.ndarray, " nv"]
    above: Float[np.ndarray, "nv nv"]
    below: Float[np.ndarray, "nv nv"]
    upper: Float[np.ndarray, "nv nv"]
    carried_mass: Float[np.ndarray, " nv"]
    stiffness: Float[np.ndarray, " nv"]
    spring: Float[np.ndarray, " J"]
    damping: Float[np.ndarray, " nv"]
    armature: Float[np.ndarray, " nv"]
    gravity: Float[np.ndarray, "3"]


class _Same:
    """A robot as a key: equal to itself alone."""

    def __init__(self, robot: Robot) -> None:
        self.robot = robot

    def __hash__(self) -> int:
        return id(self.robot)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Same) and other.robot is self.robot


def once_a_robot(read: Callable[[Robot], _T]) -> Callable[[Robot], _T]:
    """Cache what is computed from a robot; its model must not be changed afterwards."""
    cached = lru_cache(maxsize=_CACHED_ROBOTS)(lambda key: read(key.robot))

    @wraps(read)
    def reader(robot: Robot) -> _T:
        return cached(_Same(robot))

    return reader


@once_a_robot
def unconstrained(robot: Robot) -> mujoco.MjModel:
    """Return the robot's model without contacts and stops."""
    out = copy.copy(robot.model)
    off = mujoco.mjtDisableBit.mjDSBL_CONTACT | mujoco.mjtDisableBit.mjDSBL_LIMIT
    out.opt.disableflags |= int(off)
    out.opt.integrator = int(mujoco.mjtIntegrator.mjINT_IMPLICITFAST)  # RK4 has no derivatives
    return out


@once_a_robot
def force_model(robot: Robot) -> ForceModel:
    """Read the constants."""
    model = robot.model
    parent = _parents(model)
    above = np.eye(model.nv)
    for dof in range(6, model.nv):
        above[:, dof] += above[:, parent[dof]]
    above[:3] = 1.0
    above[3:6, 3:] = 1.0
    lowest = _lowest_dofs(model)
    bodies = np.flatnonzero((lowest >= 0) & (model.body_mass > 0))
    joint = np.zeros((model.nv, model.nv))
    joint[:3, :3] = joint[3:6, 3:6] = 1.0
    joint[np.arange(6, model.nv), np.arange(6, model.nv)] = 1.0
    mass = np.zeros(model.nv)
    np.add.at(mass, lowest[bodies], model.body_mass[bodies])
    turn = quat_to_matrix(model.body_iquat[bodies])
    stiffness = np.zeros(model.nv)
    stiffness[6:] = np.reshape(model.jnt_stiffness[1:].T, (-1, model.njnt - 1))[0]
    return ForceModel(
        bodies=bodies,
        last_dof=lowest[bodies],
        mass=model.body_mass[bodies].copy(),
        com=model.body_ipos[bodies].copy(),
        inertia=(turn * model.body_inertia[bodies][:, None]) @ turn.swapaxes(1, 2),
        parent=parent,
        above=above,
        below=above * (1.0 - joint),
        upper=np.maximum(above * (1.0 - joint), joint),
        carried_mass=above @ mass,
        stiffness=stiffness,
        spring=model.qpos_spring[7:].copy(),
        damping=np.reshape(model.dof_damping.T, (-1, model.nv))[0].copy(),
        armature=model.dof_armature.copy(),
        gravity=model.opt.gravity.copy(),
    )


def _parents(model: mujoco.MjModel) -> Int[np.ndarray, " nv"]:
    parent: np.ndarray = model.dof_parentid.astype(int)
    parent[3:6] = 2
    parent[:3] = 0
    return parent


def _lowest_dofs(model: mujoco.MjModel) -> Int[np.ndarray, " B"]:
    """Return the lowest dof that moves each body, -1 where none does."""
    lowest = np.full(model.nbody, -1)
    for body in range(1, model.nbody):
        count, first = model.body_dofnum[body], model.body_dofadr[body]
        lowest[body] = first + count - 1 if count else lowest[model.body_parentid[body]]
    return lowest
