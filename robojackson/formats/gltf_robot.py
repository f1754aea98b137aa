"""A robot's motion as glTF: a node a body, in the robot's tree, turned by key frames.

Blender, three.js, Windows' and Apple's viewers open it. The motion is the control steps'; a motion
that repeats is written as one cycle.
"""

from collections.abc import Mapping

import mujoco
import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from robojackson.formats.containers.gltf_scene import WORLD_TO_GLTF, GltfScene
from robojackson.formats.format import RobotExporter
from robojackson.geometry.rotations import from_rotation, to_rotation
from robojackson.geometry.surface import Surface, ball, box, capsule, cylinder, shaded
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.robot.body_states import (
    body_states,
    drawn_geoms,
    names,
    require_same_joints,
    shown_rgba,
)
from robojackson.robot.sampling import sampled

Rgb = tuple[float, float, float]
DETAIL_M = 0.004
"""Smallest detail of a mesh: the Unitree G1 then has 110,000 triangles instead of 393,000."""
KIND = mujoco.mjtGeom


def write(reference: ReferenceMotion, model: mujoco.MjModel) -> bytes:
    """Return the .glb of a reference motion.

    Raises:
        UnknownName: the model has other joints than the reference motion.
    """
    require_same_joints(reference, model)
    motion, scene = sampled(reference), GltfScene(f"{reference.robot} motion")
    add_robot(scene, model, motion.qpos, scene.clock(np.arange(len(motion)) / motion.fps))
    return scene.to_bytes()


def add_robot(
    scene: GltfScene,
    model: mujoco.MjModel,
    qpos: Float[np.ndarray, "T nq"],
    clock: int,
    name: str = "",
    tint: Rgb | None = None,
    aside_m: float = 0.0,
) -> None:
    """Add a moving robot.

    Args:
        clock: Times of the poses (`GltfScene.clock`).
        name: Put before the names of the bodies, where a scene holds several robots.
        tint: Colour of the whole robot; None takes the model's own colours.
        aside_m: How far to its left the robot is put.
    """
    states = body_states(model, np.asarray(qpos, float))
    frames, titles = _Frames(states.position, states.quaternion, aside_m), names(model, "body")
    meshes = _meshes(scene, model, name, tint)
    nodes: dict[int, int] = {}
    for body in range(1, model.nbody):
        parent = int(model.body_parentid[body])
        title, of = f"{name}{titles[body]}", meshes.get(body, {})
        node = scene.node(title, nodes.get(parent), None, None, **of)
        scene.animate(node, clock, *frames.relative(body, parent))
        nodes[body] = node


class _Frames:
    """Poses of bodies in the world, glTF's axes."""

    def __init__(self, position: np.ndarray, quaternion: np.ndarray, aside_m: float) -> None:
        self._place = (position + [0.0, aside_m, 0.0]) @ WORLD_TO_GLTF.T
        axes = Rotation.from_matrix(WORLD_TO_GLTF)
        self._turn = [axes * to_rotation(rows) for rows in quaternion.transpose(1, 0, 2)]

    def relative(self, body: int, parent: int) -> tuple[np.ndarray, np.ndarray]:
        """Return places and turns (wxyz) of a body in its parent; in the scene below the world."""
        place, turn = self._place[:, body], self._turn[body]
        if parent == 0:
            return place, from_rotation(turn)
        back = self._turn[parent].inv()
        return back.apply(place - self._place[:, parent]), from_rotation(back * turn)


def body_parts(model: mujoco.MjModel) -> dict[int, list[tuple[Surface, Rgb]]]:
    """Return what is drawn of each body, in its own frame, with its colour (sRGB 0..1)."""
    parts: dict[int, list[tuple[Surface, Rgb]]] = {}
    colours = np.clip(shown_rgba(model)[:, :3], 0.0, 1.0)
    for geom in map(int, drawn_geoms(model)):
        surface = _placed(model, geom)
        if len(surface.faces):
            body = int(model.geom_bodyid[geom])
            red, green, blue = map(float, colours[geom])
            parts.setdefault(body, []).append((surface, (red, green, blue)))
    return parts


def _meshes(
    scene: GltfScene, model: mujoco.MjModel, name: str, tint: Rgb | None
) -> Mapping[int, Mapping[str, int]]:
    """Add a mesh a body that has anything to show; return their numbers by body."""
    colours: dict[Rgb, int] = {}
    titles, made = names(model, "body"), {}
    for body, parts in body_parts(model).items():
        for rgb in {tint or own for _, own in parts} - set(colours):
            colours[rgb] = scene.material(f"{name}colour {len(colours) + 1}", rgb)
        dressed = [(surface, colours[tint or own]) for surface, own in parts]
        made[body] = {"mesh": scene.mesh(f"{name}{titles[body]}", dressed)}
    return made


def _placed(model: mujoco.MjModel, geom: int) -> Surface:
    """Return the surface of a geom in its body."""
    surface = _surface(model, geom)
    turn = to_rotation(model.geom_quat[geom])
    vertices = turn.apply(surface.vertices) + model.geom_pos[geom]
    return Surface(vertices, turn.apply(surface.normals), surface.faces)


def _surface(model: mujoco.MjModel, geom: int) -> Surface:
    size, kind = model.geom_size[geom], int(model.geom_type[geom])
    if kind == KIND.mjGEOM_MESH:
        return _mesh(model, int(model.geom_dataid[geom]))
    if kind == KIND.mjGEOM_CAPSULE:
        return capsule(size[0], size[1])
    if kind == KIND.mjGEOM_CYLINDER:
        return cylinder(size[0], size[1])
    if kind == KIND.mjGEOM_BOX:
        return box(size)
    return ball(size if kind == KIND.mjGEOM_ELLIPSOID else np.full(3, size[0]))


def _mesh(model: mujoco.MjModel, mesh: int) -> Surface:
    first, start = model.mesh_vertadr[mesh], model.mesh_faceadr[mesh]
    vertices = model.mesh_vert[first : first + model.mesh_vertnum[mesh]]
    return shaded(vertices, model.mesh_face[start : start + model.mesh_facenum[mesh]], DETAIL_M)


EXPORT = RobotExporter("gltf", write)
