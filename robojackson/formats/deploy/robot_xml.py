"""The robot of a deploy pack as one MJCF without meshes: collision shapes, masses and motors.

The physics is that of the compiled robot: gains are not part of it, as in training.
"""

import mujoco
import numpy as np

from robojackson.errors import BadConfiguration
from robojackson.robot.mjcf import mjcf_path, read_spec
from robojackson.robot.model import Robot
from robojackson.robot.physics import add_floor, apply_physics

TOLERANCE = 1e-4
"""Largest relative difference between a figure of the robot and of its MJCF, which has few
digits."""
FIGURES = ("body_mass", "body_inertia", "body_ipos", "body_pos", "dof_armature", "dof_damping",
           "jnt_range", "actuator_gear")  # fmt: skip


def robot_xml(robot: Robot) -> bytes:
    """Return the MJCF of a robot, which needs no other file.

    Raises:
        BadConfiguration: the robot collides with meshes, or the written file is not the same robot.
    """
    description = robot.description
    spec = read_spec(mjcf_path(description), description)
    add_floor(spec)
    apply_physics(spec, description)
    for actuator in spec.actuators:
        actuator.gear = np.asarray(actuator.gear) * description.gear_scale
    _strip_looks(spec)
    spec.compile()
    text: str = spec.to_xml()
    try:
        again = mujoco.MjModel.from_xml_string(text)
    except ValueError as error:
        raise BadConfiguration(
            f"robot {description.name!r} cannot be written as one file "
            f"({str(error).splitlines()[0]}): a deploy pack needs collision shapes without meshes"
        ) from error
    _require_same(robot, again)
    return text.encode()


def _strip_looks(spec: mujoco.MjSpec) -> None:
    """Remove visual parts: geoms without collision and mass, meshes, textures, skins."""
    for geom in list(spec.geoms):
        weighs = geom.density and not geom.parent.explicitinertial
        collides = geom.contype or geom.conaffinity
        if geom.type == mujoco.mjtGeom.mjGEOM_MESH and not (collides or weighs):
            spec.delete(geom)
    for material in spec.materials:
        material.textures = [""] * len(material.textures)
    for each in (*spec.textures, *spec.skins):
        spec.delete(each)
    used = {geom.meshname for geom in spec.geoms}
    for mesh in list(spec.meshes):
        if mesh.name not in used:
            spec.delete(mesh)


def _require_same(robot: Robot, written: mujoco.MjModel) -> None:
    model = robot.model
    for name in FIGURES:
        ours, theirs = getattr(model, name), getattr(written, name)
        if ours.shape != theirs.shape or not np.allclose(ours, theirs, TOLERANCE, TOLERANCE**2):
            raise BadConfiguration(
                f"robot {robot.description.name!r} cannot be written as one MJCF: {name} changes"
            )
