"""Poses and velocities of a robot's bodies and sites in every frame, as MuJoCo computes them.

World frame, metres, radians, seconds, quaternions wxyz; bodies in MuJoCo's order, the world first.
"""

from dataclasses import dataclass

import mujoco
import numpy as np
from jaxtyping import Float, Int

from robojackson.errors import UnknownName
from robojackson.motion.reference_motion import ReferenceMotion


@dataclass(frozen=True)
class BodyStates:
    """One row a frame.

    Attributes:
        position, quaternion: Position and quaternion of the body frames, metres, wxyz.
        linear, angular: Velocities of the body frames' origins, m/s and rad/s, world axes.
        com_velocity: MuJoCo's `cvel`: angular, then linear, about the centre of mass of the tree.
        subtree_com: Centre of mass of each body with all that hang from it, metres.
        site_position, site_rotation: Places of the sites, metres, and row-major matrices.
    """

    position: Float[np.ndarray, "T B 3"]
    quaternion: Float[np.ndarray, "T B 4"]
    linear: Float[np.ndarray, "T B 3"]
    angular: Float[np.ndarray, "T B 3"]
    com_velocity: Float[np.ndarray, "T B 6"]
    subtree_com: Float[np.ndarray, "T B 3"]
    site_position: Float[np.ndarray, "T K 3"]
    site_rotation: Float[np.ndarray, "T K 9"]


def body_states(
    model: mujoco.MjModel,
    qpos: Float[np.ndarray, "T nq"],
    qvel: Float[np.ndarray, "T nv"] | None = None,
) -> BodyStates:
    """Return the forward kinematics frame by frame; without velocities everything stands still."""
    data = mujoco.MjData(model)
    moving = np.zeros((len(qpos), model.nv)) if qvel is None else qvel
    rows = [_row(model, data, *pair) for pair in zip(qpos, moving, strict=True)]
    return BodyStates(*(np.stack(column) for column in zip(*rows, strict=True)))


def require_same_joints(reference: ReferenceMotion, model: mujoco.MjModel) -> None:
    """Require that the model's hinges are those of the reference motion, in the same order.

    Raises:
        UnknownName: a joint of the reference that the model has not at its place.
    """
    known = [model.joint(index).name for index in range(1, model.njnt)]
    for place, name in enumerate(reference.joint_names):
        if place >= len(known) or known[place] != name:
            raise UnknownName("joint", name, f"reference motion of {reference.robot!r}", known)


def names(model: mujoco.MjModel, kind: str) -> list[str]:
    """Return names of all bodies, joints or sites (`kind`), in MuJoCo's order."""
    count = {"body": model.nbody, "joint": model.njnt, "site": model.nsite}[kind]
    accessor = getattr(model, kind)
    return [accessor(index).name for index in range(count)]


def drawn_geoms(model: mujoco.MjModel) -> Int[np.ndarray, " G"]:
    """Return the numbers of a robot's geoms that are drawn."""
    shown = mujoco.MjvOption().geomgroup[model.geom_group] > 0
    return np.flatnonzero((model.geom_bodyid > 0) & shown & (model.geom_rgba[:, 3] > 0))


def _row(
    model: mujoco.MjModel, data: mujoco.MjData, qpos: np.ndarray, qvel: np.ndarray
) -> tuple[np.ndarray, ...]:
    """Return the fields of BodyStates for one pose."""
    data.qpos[:], data.qvel[:] = qpos, qvel
    mujoco.mj_fwdPosition(model, data)
    mujoco.mj_comVel(model, data)
    speed = np.zeros((model.nbody, 6))
    kind = int(mujoco.mjtObj.mjOBJ_XBODY)
    for body in range(model.nbody):
        mujoco.mj_objectVelocity(model, data, kind, body, speed[body], 0)
    parts = (data.xpos, data.xquat, speed[:, 3:], speed[:, :3], data.cvel, data.subtree_com)
    return tuple(part.copy() for part in (*parts, data.site_xpos, data.site_xmat))
