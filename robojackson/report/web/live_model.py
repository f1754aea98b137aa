"""A robot's model for a browser: MJCF without visual parts, and the numbers that the text rounds.

MuJoCo writes six digits. A mass that differs in the seventh moves a robot by centimetres, where a
limb just touches or just does not.
"""

import mujoco
import numpy as np

from robojackson.report.web.shapes import packed
from robojackson.retarget.feasibility.force_model import once_a_robot
from robojackson.robot.mjcf import described_spec, mjcf_path
from robojackson.robot.model import Robot
from robojackson.robot.physics import solid_in

PARTS = ("body_", "dof_", "jnt_", "geom_", "pair_", "tendon_", "actuator_")
"""First words of the names of the arrays that physics depends on."""


@once_a_robot
def live_model(robot: Robot) -> tuple[str, dict[str, str]]:
    """Return the MJCF and, by its name, each array of the model that it does not give exactly.

    Raises:
        ValueError, RuntimeError, mujoco.FatalError: MuJoCo reads no such part of the model.
    """
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
    _measure_fitted(spec)
    solid = solid_in(spec)
    for body in spec.bodies:
        shown = [geom for geom in body.geoms if not solid(geom)]
        if shown and body.name != "world":
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


def _measure_fitted(spec: mujoco.MjSpec) -> None:
    """Give the boxes, capsules and spheres that are fitted to a mesh the size and place that they
    compile to, so that they need no mesh."""
    mesh = mujoco.mjtGeom.mjGEOM_MESH
    fitted = [geom for geom in spec.geoms if geom.meshname and geom.type != mesh]
    if not fitted:
        return
    model = spec.compile()
    for geom in fitted:
        geom.meshname, geom.alt.type = "", mujoco.mjtOrientation.mjORIENTATION_QUAT
        geom.size, geom.pos = model.geom_size[geom.id], model.geom_pos[geom.id]
        geom.quat = model.geom_quat[geom.id]
