"""Requirements of a robot: a free root with limited hinges, mirrored sides, level soles at rest,
lengths in metres and angles in radians, and a floor at z = 0."""

from collections.abc import Iterator, Sequence
from itertools import chain

import mujoco
import numpy as np
from jaxtyping import Float

from robojackson.errors import BadConfiguration
from robojackson.robot.body_states import own_bodies, solid_geoms
from robojackson.robot.description import RobotDescription
from robojackson.robot.names import known, matching, where

_SYMMETRY_M = 1e-3
_LEVEL_M = 0.005
_FLOOR_M, _FLOOR_RAD = 1e-4, 1e-3
_WALL_RAD = 1.0  # a plane that is tilted so far is a wall
_BONES = (("hip", "knee"), ("knee", "foot"), ("shoulder", "elbow"), ("elbow", "hand"))
_LABELS = ("left", "right")
_REMEDIES = {
    "free": "only {root!r} may move freely; remove that joint, or leave the body out",
    "ball": "put three hinges with ranges in its place, or remove it",
    "slide": "a robot has hinges alone; put a hinge with a range in its place, or remove it",
    "hinge": "it has no range; give it one",
}
"""What to do about a joint that is no limited hinge, by its type."""


def check_model(model: mujoco.MjModel, description: RobotDescription) -> None:
    """Require the joints, the units and the floor of a robot."""
    for fault in chain(joint_faults(model, description), unit_faults(model, description)):
        raise BadConfiguration(fault)
    check_floor(model, description)


def joint_faults(model: mujoco.MjModel, description: RobotDescription) -> Iterator[str]:
    """Yield a line for each joint that is neither the free one of the root body, the first, nor a
    limited hinge.

    Raises:
        UnknownName: the model has no such root body.
    """
    bodies = [model.body(index).name for index in range(model.nbody)]
    root = known("body", description.root_body, bodies, where(description, "root_body"))
    free, hinge = int(mujoco.mjtJoint.mjJNT_FREE), int(mujoco.mjtJoint.mjJNT_HINGE)
    is_free, carriers = model.jnt_type == free, model.jnt_bodyid
    unfit = is_free | (model.jnt_type != hinge) | (model.jnt_limited == 0)
    on_root = is_free & (carriers == model.body(root).id)
    if not on_root.any():
        others = ", ".join(repr(bodies[body]) for body in carriers[is_free])
        remedy = f"{others} has one" if others else "give it one, <freejoint/>"
        yield f"{where(description, 'root_body')}: {root!r} has no free joint; {remedy}"
    for index in np.flatnonzero(unfit & ~on_root):
        kind = mujoco.mjtJoint(int(model.jnt_type[index])).name.removeprefix("mjJNT_").lower()
        if kind == "free" and not on_root.any():
            continue
        name = f" {model.joint(index).name!r}" if model.joint(index).name else ""
        yield (
            f"{where(description, 'mjcf')}: body {bodies[carriers[index]]!r} has the {kind} "
            f"joint{name}: {_REMEDIES[kind].format(root=root)}"
        )


def unit_faults(model: mujoco.MjModel, description: RobotDescription) -> Iterator[str]:
    """Yield a line for each length that is larger than the robot, and for a tilt beyond half a
    turn: millimetres and degrees in place of metres and radians."""
    size = _size(model)
    lengths: dict[str, Sequence[float]] = {
        f"sites.{key}": at for key, (_, at) in description.sites.items()
    }
    for name, ball in description.contacts.items():
        lengths[f"contacts.{name}.offset"] = ball.offset
        lengths[f"contacts.{name}.radius"] = (ball.radius,)
    lengths["imu"] = description.imu
    for key, place in lengths.items():
        far = float(np.linalg.norm(place))
        if far > size:
            yield (
                f"{where(description, key)}: {far:.3g} m is more than the whole robot, "
                f"{size:.2g} m; lengths are in metres"
            )
    tilt = description.fall.tilt
    if tilt > np.pi:
        yield (
            f"{where(description, 'fall.tilt')} is {tilt:g}: at most 3.14 radians, half a turn; "
            f"{tilt:g} degrees are {np.radians(tilt):.3g} radians"
        )


def _size(model: mujoco.MjModel) -> float:
    """Return the largest extent of the robot along an axis in the MJCF's pose, metres."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    own = own_bodies(model)
    geoms = own[model.geom_bodyid] & (model.geom_type != int(mujoco.mjtGeom.mjGEOM_PLANE))
    reach, at = model.geom_rbound[geoms, None], data.geom_xpos[geoms]
    points: Float[np.ndarray, "P 3"] = np.concatenate([data.xpos[own], at - reach, at + reach])
    return float(np.ptp(points, axis=0).max())


def check_floor(model: mujoco.MjModel, description: RobotDescription) -> None:
    """Require that every plane that can be touched, walls apart, is level at z = 0, where motions
    have their floor."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    plane = model.geom_type == int(mujoco.mjtGeom.mjGEOM_PLANE)
    planes = np.flatnonzero(solid_geoms(model) & plane)
    tilts = np.arccos(np.clip(data.geom_xmat[planes, 8], -1.0, 1.0))
    if len(planes) and (tilts > _WALL_RAD).all():
        raise BadConfiguration(
            f"{where(description, 'mjcf')}: the plane {model.geom(planes[0]).name!r} is a wall and "
            "there is no floor; add a plane that is level at z = 0"
        )
    for index, tilt in zip(planes, tilts, strict=True):
        height = float(data.geom_xpos[index, 2])
        if tilt < _WALL_RAD and (abs(height) > _FLOOR_M or tilt > _FLOOR_RAD):
            raise BadConfiguration(
                f"{where(description, 'mjcf')}: the plane {model.geom(index).name!r} is at "
                f"z = {height:g} m and {np.degrees(tilt):.3g} degrees from level, and motions "
                "have their floor level at z = 0; put it there, or leave it out: one is added"
            )


def check_names(
    description: RobotDescription, bodies: tuple[str, ...], joints: tuple[str, ...]
) -> None:
    """Require that every body, joint and keypoint of contacts, weights and poses is known."""
    if not description.contacts:
        raise BadConfiguration(f"{where(description, 'contacts')}: a robot needs feet")
    for name in description.contacts:
        check_contact(description, name, bodies)
    for key in description.weights:
        known("keypoint", key, description.sites, where(description, "weights"))
    for joint in description.rest_pose:
        matching("joint", joint, joints, where(description, "rest_pose"))


def check_contact(description: RobotDescription, name: str, bodies: tuple[str, ...]) -> None:
    """Require that body, keypoint and side of a contact are known, and the body carries the
    keypoint."""
    point, place = description.contacts[name], where(description, f"contacts.{name}")
    known("body", point.body, bodies, f"{place}.body")
    known("keypoint", point.site, description.sites, f"{place}.site")
    known("side", point.side, _LABELS, f"{place}.side")
    carrier = description.sites[point.site][0]
    if carrier != point.body:
        raise BadConfiguration(f"{place}: {point.site} is on {carrier!r}, not {point.body!r}")


def check_symmetry(description: RobotDescription, lengths: dict[tuple[str, str], float]) -> None:
    """Require limbs of the same length on both sides."""
    for a, b in _BONES:
        left = lengths[f"left_{a}", f"left_{b}"]
        right = lengths[f"right_{a}", f"right_{b}"]
        if abs(left - right) > _SYMMETRY_M:
            raise BadConfiguration(
                f"{where(description, 'sites')}: left_{a} to left_{b} is {left:.4f} m on the left "
                f"and {right:.4f} m on the right; they must be mirrored"
            )


def check_soles(description: RobotDescription, soles: np.ndarray) -> None:
    """Require all soles at one height in the rest pose; else the rest pose or the balls are wrong.

    Args:
        soles: Heights of the lowest points of the balls in the rest pose, metres.
    """
    if np.ptp(soles) > _LEVEL_M:
        heights = ", ".join(
            f"{name} {1e3 * height:.0f}"
            for name, height in zip(description.contacts, soles - soles.min(), strict=True)
        )
        raise BadConfiguration(
            f"{where(description, 'contacts')}: in the rest pose the soles are not level; "
            f"heights over the lowest, mm: {heights}"
        )
