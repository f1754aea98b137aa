"""The scene in which a robot is drawn: the same floor, light and background for every robot.

Floors, lights and skies of the robots' own models differ (mjlab's G1 is in the dark), and a stage
or a wall may hide the robot, so none of them is drawn. Metres; RGB 0..1.
"""

import copy
from functools import lru_cache

import cv2
import mujoco
import numpy as np
from jaxtyping import Float

from robojackson.report.video.canvas import BACKDROP, Picture
from robojackson.report.video.mesh_detail import simplify
from robojackson.report.video.panel_camera import FOCAL
from robojackson.robot.body_states import drawn_geoms, shown_rgba

Tint = tuple[float, float, float]
SHADOW_ALPHA, SHADOW_HEIGHT = 0.28, 0.004
"""Opacity, metres. A dark disc under each part: cast shadows would double the drawing time."""
SHADOW_REACH = 0.7
"""Radius of a part's disc over that of the ball around it."""
FLOOR, LINE = (0.40, 0.43, 0.46), (0.55, 0.58, 0.62)
FLOOR_REACH, LINE_REACH, LINE_CELL, LINE_WIDTH, LINE_HEIGHT = 60.0, 8, 0.5, 0.012, 0.001
"""Size of a cell, metres; number of cells to each side."""
HEAD_AMBIENT, HEAD_DIFFUSE, KEY_DIFFUSE, KEY_SPECULAR = 0.28, 0.42, 0.42, 0.15
KEY_DIRECTION = (-0.45, -0.35, -0.82)
"""Direction of the second light, world; the first is the camera's."""
DETAIL_M = 0.005
"""Smallest detail of a robot's meshes; a pixel of a panel is about as large."""
FAR = 1.0
"""Depth of empty pixels."""


def dressed(model: mujoco.MjModel, width: int, height: int, tint: Tint) -> mujoco.MjModel:
    """Return a copy of the model with our lens, the robot in one colour, and nothing else."""
    dressed = copy.copy(model)
    simplify(dressed, DETAIL_M)
    dressed.vis.quality.offsamples = 0
    dressed.vis.global_.offwidth, dressed.vis.global_.offheight = width, height
    dressed.vis.global_.fovy = float(np.degrees(2.0 * np.arctan(0.5 / FOCAL)))
    drawn = drawn_geoms(dressed)
    opacity = shown_rgba(dressed)[drawn, 3]
    dressed.geom_matid[:] = -1
    dressed.geom_rgba[:] = 0.0
    dressed.geom_rgba[drawn, :3], dressed.geom_rgba[drawn, 3] = tint, opacity
    return dressed


def furnish(
    scene: mujoco.MjvScene,
    model: mujoco.MjModel,
    data: mujoco.MjData,
    target: Float[np.ndarray, "2"],
) -> None:
    """Add floor, grid and shadows to a scene that was just updated, and replace its lights."""
    _light(scene)
    _add_floor(scene, np.round(target / LINE_CELL) * LINE_CELL)
    for geom in drawn_geoms(model):
        radius = SHADOW_REACH * float(model.geom_rbound[geom])
        at = [*data.geom_xpos[geom, :2], SHADOW_HEIGHT]
        size = [radius, radius, SHADOW_HEIGHT / 4]
        _add(scene, mujoco.mjtGeom.mjGEOM_ELLIPSOID, size, at, (0.0, 0.0, 0.0), SHADOW_ALPHA)


def on_backdrop(picture: Picture, depth: Float[np.ndarray, "H W"]) -> Picture:
    """Return the picture with our background where nothing was drawn, in place."""
    return cv2.copyTo(_backdrop(picture.shape), (depth >= FAR).astype(np.uint8), picture)


@lru_cache
def _backdrop(shape: tuple[int, ...]) -> Picture:
    return np.full(shape, BACKDROP, np.uint8)


def _light(scene: mujoco.MjvScene) -> None:
    head, key = scene.lights[0], scene.lights[1]
    eye = (np.array(scene.camera[0].pos) + np.array(scene.camera[1].pos)) / 2
    for light, direction in ((head, scene.camera[0].forward), (key, KEY_DIRECTION)):
        light.type = mujoco.mjtLightType.mjLIGHT_DIRECTIONAL.value
        light.headlight, light.castshadow, light.texid = light is head, 0, -1
        light.pos, light.dir = eye, np.asarray(direction) / np.linalg.norm(direction)
        light.attenuation[:] = [1.0, 0.0, 0.0]
    head.ambient[:], head.diffuse[:], head.specular[:] = HEAD_AMBIENT, HEAD_DIFFUSE, 0.0
    key.ambient[:], key.diffuse[:], key.specular[:] = 0.0, KEY_DIFFUSE, KEY_SPECULAR
    scene.nlight = 2


def _add_floor(scene: mujoco.MjvScene, middle: Float[np.ndarray, "2"]) -> None:
    plane, box = mujoco.mjtGeom.mjGEOM_PLANE, mujoco.mjtGeom.mjGEOM_BOX
    _add(scene, plane, [FLOOR_REACH, FLOOR_REACH, 1.0], [*middle, 0.0], FLOOR)
    reach = LINE_REACH * LINE_CELL
    for tick in np.arange(-LINE_REACH, LINE_REACH + 1) * LINE_CELL:
        half = [LINE_WIDTH / 2, reach, LINE_HEIGHT / 2]
        _add(scene, box, half, [middle[0] + tick, middle[1], 0.0], LINE)
        _add(scene, box, [half[1], half[0], half[2]], [middle[0], middle[1] + tick, 0.0], LINE)


def _add(
    scene: mujoco.MjvScene,
    kind: mujoco.mjtGeom,
    size: list[float],
    at: list[float],
    colour: Tint,
    alpha: float = 1.0,
) -> None:
    geom = scene.geoms[scene.ngeom]
    rgba = np.array([*colour, alpha], np.float32)
    mujoco.mjv_initGeom(geom, kind.value, np.array(size), np.array(at), np.eye(3).ravel(), rgba)
    geom.specular = geom.reflectance = 0.0
    scene.ngeom += 1
