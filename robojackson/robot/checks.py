"""Requirements of a robot: a free root with limited hinges, mirrored sides, level soles at rest,
and a floor at z = 0."""

import mujoco
import numpy as np

from robojackson.errors import BadConfiguration
from robojackson.robot.body_states import solid_geoms
from robojackson.robot.description import RobotDescription
from robojackson.robot.names import known, matching, where

_SYMMETRY_M = 1e-3
_LEVEL_M = 0.005
_FLOOR_M, _FLOOR_RAD = 1e-4, 1e-3
_WALL_RAD = 1.0  # a plane that is tilted so far is a wall
_BONES = (("hip", "knee"), ("knee", "foot"), ("shoulder", "elbow"), ("elbow", "hand"))
_LABELS = ("left", "right")


def check_model(model: mujoco.MjModel, description: RobotDescription) -> None:
    """Require the joints and the floor of a robot."""
    check_joints(model, description)
    check_floor(model, description)


def check_joints(model: mujoco.MjModel, description: RobotDescription) -> None:
    """Require one free joint, first, on the root body; every other joint is a limited hinge."""
    bodies = [model.body(index).name for index in range(model.nbody)]
    root = known("body", description.root_body, bodies, where(description, "root_body"))
    free = int(mujoco.mjtJoint.mjJNT_FREE)
    hinge = int(mujoco.mjtJoint.mjJNT_HINGE)
    if model.jnt_type[0] != free or model.jnt_bodyid[0] != model.body(root).id:
        raise BadConfiguration(f"{where(description, 'root_body')}: {root!r} has no free joint")
    for index in range(1, model.njnt):
        if model.jnt_type[index] != hinge or not model.jnt_limited[index]:
            name = model.joint(index).name
            raise BadConfiguration(f"{where(description, 'mjcf')}: {name!r} is no limited hinge")


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
