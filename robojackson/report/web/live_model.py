"""A robot's model for a browser: MJCF without visual parts, and the numbers that the text rounds.

MuJoCo writes six digits. A mass that differs in the seventh moves a robot by centimetres, where a
limb just touches or just does not.
"""

import mujoco
import numpy as np

from robojackson.report.web.shapes import packed
from robojackson.robot.mjcf import described_spec, mjcf_path
from robojackson.robot.model import Robot

PARTS = ("body_", "dof_", "jnt_", "geom_", "tendon_", "actuator_")
"""First words of the names of the arrays that physics depends on."""


def live_model(robot: Robot) -> tuple[str, dict[str, str]]:
    """Return the MJCF and, by its name, each array of the model that it does not give exactly."""
    spec = _without_visual_parts(robot)
    bare = spec.compile()
    xml = str(spec.to_xml())
    read = mujoco.MjModel.from_xml_string(xml)
    numbers = {}
    for name in dir(read):
        rounded = getattr(read, name) if name.startswith(PARTS) else None
        if not isinstance(rounded, np.ndarray) or rounded.dtype.kind != "f":
            continue
        whole = getattr(robot.model, name)
        exact = whole if whole.shape == rounded.shape else getattr(bare, name)
        if not np.array_equal(exact, rounded):
            numbers[name] = packed(exact, np.float64)
    return xml, numbers


def _without_visual_parts(robot: Robot) -> mujoco.MjSpec:
    spec = described_spec(robot.description, mjcf_path(robot.description))
    for body in spec.bodies[1:]:
        shown = [geom for geom in body.geoms if not (geom.contype or geom.conaffinity)]
        if not shown:
            continue
        index = robot.model.body(body.name).id
        body.mass, body.explicitinertial = float(robot.model.body_mass[index]), True
        body.inertia = robot.model.body_inertia[index]
        body.ipos, body.iquat = robot.model.body_ipos[index], robot.model.body_iquat[index]
        for geom in shown:
            spec.delete(geom)
    parts = [*spec.meshes, *spec.sensors, *spec.keys]
    if any(texture.file for texture in spec.textures):
        parts += [*spec.textures, *spec.materials]
        for geom in spec.geoms:
            geom.material = ""
    for part in parts:
        spec.delete(part)
    return spec
