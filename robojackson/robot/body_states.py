"""Bodies of a compiled model: which are the robot's, which its feet, and their states by frame.

Those that its free joint carries are the robot's. A stage, a box or a marker beside it is fixed to
the world, and is part of that. World frame, metres, radians, seconds, kilograms, quaternions wxyz;
bodies in MuJoCo's order, the world first.
"""

from dataclasses import dataclass

import mujoco
import numpy as np
from jaxtyping import Bool, Float, Int

from robojackson.errors import UnknownName
from robojackson.motion.reference_motion import ReferenceMotion

UNDYED = np.array([0.5, 0.5, 0.5, 1.0])
"""MuJoCo's default colour of a geom, RGBA."""


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
    """Return the numbers of a robot's geoms that are drawn; a plane has no end, and is none."""
    shown = mujoco.MjvOption().geomgroup[model.geom_group] > 0
    plane = model.geom_type == int(mujoco.mjtGeom.mjGEOM_PLANE)
    visible = shown_rgba(model)[:, 3] > 0
    own = own_bodies(model)[model.geom_bodyid]
    return np.flatnonzero(own & shown & visible & ~plane)


def shown_rgba(model: mujoco.MjModel) -> Float[np.ndarray, "G 4"]:
    """Return the colour in which MuJoCo draws each geom, 0..1: the geom's own, or that of its
    material where it has no other than the default."""
    rgba: np.ndarray = model.geom_rgba.copy()
    dyed = (model.geom_matid >= 0) & (rgba == UNDYED).all(axis=1)
    rgba[dyed] = model.mat_rgba[model.geom_matid[dyed]]
    return rgba


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


def solid_geoms(model: mujoco.MjModel) -> Bool[np.ndarray, " G"]:
    """Return whether each geom can touch another, by its type and affinity or by a pair."""
    result: np.ndarray = (model.geom_contype | model.geom_conaffinity) != 0
    result[model.pair_geom1] = result[model.pair_geom2] = True
    return result


def foot_bodies(model: mujoco.MjModel, contacts: Int[np.ndarray, " C"]) -> Int[np.ndarray, " F"]:
    """Return the bodies of the feet: those of the contacts and what is welded below them.

    A body that touches nothing, such as a frame under the sole, stands for the nearest body above
    it that does and that it is welded to: beyond that is the leg, to which a foot without an ankle
    is welded, too.

    Args:
        contacts: Bodies of its contact points.
    """
    touching = np.isin(np.arange(model.nbody), model.geom_bodyid[solid_geoms(model)])
    found: set[int] = set()
    for body in contacts:
        foot = _welded_below(model, int(body))
        while not touching[foot].any() and model.body_weldid[body] != body:
            body = model.body_parentid[body]
            foot = _welded_below(model, int(body))
        found.update(foot)
    return np.array(sorted(found))


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


def _welded_below(model: mujoco.MjModel, body: int) -> list[int]:
    found = [body]
    for child in range(body + 1, model.nbody):  # parents come first
        if model.body_parentid[child] in found and not model.body_jntnum[child]:
            found.append(child)
    return found
