"""The robot as MuJoCo draws it, posed by qpos, followed by a camera like the skeleton's.

Without a screen this needs EGL (or OSMesa); `MUJOCO_GL` is honoured, but not needed: MuJoCo reads
it when it is imported, which is long before anybody here knows that a picture will be wanted.
"""

import contextlib
import copy
import importlib
import os
import sys
from types import TracebackType
from typing import Any

import mujoco
import numpy as np
from jaxtyping import Float

from robojackson.errors import MissingDependency
from robojackson.report.video import canvas
from robojackson.report.video.skeleton_panel import CAMERA_HEIGHT, DISTANCE, FOCAL, LOOK_AT_HEIGHT

LINUX_BACKENDS = ("egl", "osmesa")
FLOOR_DARK, FLOOR_CONTRAST = 70, 0.22
"""Floor textures become grey levels from 70 to 126 of 255."""
SHADOW_ALPHA, SHADOW_HEIGHT = 0.28, 0.002
"""Opacity, metres. A dark disc under each part: cast shadows would double the drawing time."""
GRAPHICS_INSTALL = (
    "apt-get install --no-install-recommends libegl1 libgles2 libopengl0 libgl1-mesa-dri"
)
Tint = tuple[float, float, float]
REFERENCE_TINT: Tint = (0.55, 0.66, 0.86)
TRAINED_TINT: Tint = (0.93, 0.62, 0.33)
"""RGB 0..1."""


class RobotView:
    """An off-screen camera for one model; use it in a `with` block.

    Raises:
        MissingDependency: no way to draw without a screen.
    """

    def __init__(self, model: mujoco.MjModel, width: int, height: int, tint: Tint) -> None:
        self.model = _dressed(model, width, height, tint)
        self._data = mujoco.MjData(self.model)
        self._gl = _gl_context(width, height)
        self._gl.make_current()
        self._context = mujoco.MjrContext(self.model, mujoco.mjtFontScale.mjFONTSCALE_100.value)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN.value, self._context)
        self._scene = mujoco.MjvScene(self.model, maxgeom=1000)
        for flag in (mujoco.mjtRndFlag.mjRND_REFLECTION, mujoco.mjtRndFlag.mjRND_SHADOW):
            self._scene.flags[flag] = 0
        self._camera, self._options = mujoco.MjvCamera(), mujoco.MjvOption()
        self._options.sitegroup[:] = 0
        self._rect = mujoco.MjrRect(0, 0, width, height)

    def picture(
        self,
        qpos: Float[np.ndarray, " nq"],
        target: Float[np.ndarray, "2"],
        azimuth_deg: float,
    ) -> canvas.Picture:
        """The robot in a pose, the camera looking at a place on the floor."""
        self._data.qpos[:] = qpos
        mujoco.mj_kinematics(self.model, self._data)
        mujoco.mj_comPos(self.model, self._data)
        mujoco.mj_camlight(self.model, self._data)
        self._aim(target, azimuth_deg)
        self._gl.make_current()
        everything = mujoco.mjtCatBit.mjCAT_ALL.value
        mujoco.mjv_updateScene(
            self.model, self._data, self._options, None, self._camera, everything, self._scene
        )
        self._add_shadows()
        mujoco.mjr_render(self._rect, self._scene, self._context)
        out = np.empty((self._rect.height, self._rect.width, 3), np.uint8)
        mujoco.mjr_readPixels(out, None, self._rect, self._context)
        return np.ascontiguousarray(out[::-1])

    def close(self) -> None:
        """Free what the graphics driver holds."""
        self._gl.make_current()
        self._context.free()
        self._gl.free()

    def __enter__(self) -> "RobotView":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def _add_shadows(self) -> None:
        for geom in np.flatnonzero(self.model.geom_bodyid > 0):
            radius = 0.7 * float(self.model.geom_rbound[geom])
            at = self._data.geom_xpos[geom] * [1.0, 1.0, 0.0] + [0.0, 0.0, SHADOW_HEIGHT]
            disc = self._scene.geoms[self._scene.ngeom]
            size = np.array([radius, radius, SHADOW_HEIGHT / 4])
            kind = mujoco.mjtGeom.mjGEOM_ELLIPSOID.value
            black = np.array([0.0, 0.0, 0.0, SHADOW_ALPHA], np.float32)
            mujoco.mjv_initGeom(disc, kind, size, at, np.eye(3).ravel(), black)
            self._scene.ngeom += 1

    def _aim(self, target: Float[np.ndarray, "2"], azimuth_deg: float) -> None:
        rise = CAMERA_HEIGHT - LOOK_AT_HEIGHT
        self._camera.lookat[:] = [*target, LOOK_AT_HEIGHT]
        self._camera.distance = float(np.hypot(DISTANCE, rise))
        self._camera.azimuth = 180.0 + azimuth_deg
        self._camera.elevation = -float(np.degrees(np.arctan2(rise, DISTANCE)))


def _dressed(model: mujoco.MjModel, width: int, height: int, tint: Tint) -> mujoco.MjModel:
    """A copy of the model with room for the picture, our lens, and the robot in one colour."""
    dressed = copy.copy(model)
    dressed.vis.global_.offwidth = max(width, dressed.vis.global_.offwidth)
    dressed.vis.global_.offheight = max(height, dressed.vis.global_.offheight)
    dressed.vis.global_.fovy = float(np.degrees(2.0 * np.arctan(0.5 / FOCAL)))
    for material in dressed.geom_matid[dressed.geom_bodyid == 0]:
        _soften(dressed, int(material))
    on_robot = dressed.geom_bodyid > 0
    dressed.geom_matid[on_robot] = -1
    dressed.geom_rgba[on_robot, :3] = tint
    return dressed


def _soften(model: mujoco.MjModel, material: int) -> None:
    """Take the glare out of a floor's checkers, in place."""
    if material < 0:
        return
    model.mat_specular[material] = model.mat_reflectance[material] = 0.0
    for texture in model.mat_texid[material]:
        if texture >= 0:
            start = int(model.tex_adr[texture])
            size = model.tex_height[texture] * model.tex_width[texture]
            texels = slice(start, start + int(size * model.tex_nchannel[texture]))
            model.tex_data[texels] = FLOOR_DARK + FLOOR_CONTRAST * model.tex_data[texels]


def _gl_context(width: int, height: int) -> Any:
    """A context of the first backend that works.

    PyTorch's CUDA build brings triton, whose LLVM ends the process with a segmentation fault where
    Mesa's software renderer has brought its own before; the other way round both work. So the
    optimizer of a later training finds triton loaded.
    """
    with contextlib.suppress(ImportError):
        importlib.import_module("triton")
    chosen = os.environ.get("MUJOCO_GL", "").lower()
    if sys.platform != "linux" or chosen == "glfw":
        return mujoco.GLContext(width, height)
    reasons = []
    for backend in (chosen,) if chosen in LINUX_BACKENDS else LINUX_BACKENDS:
        try:
            return importlib.import_module(f"mujoco.{backend}").GLContext(width, height)
        except Exception as error:  # each backend has its own exceptions for a missing library
            reasons.append(f"{backend}: {error}")
    raise MissingDependency(f"no off-screen graphics ({'; '.join(reasons)}): {GRAPHICS_INSTALL}")
