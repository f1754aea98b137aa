"""The robot as MuJoCo draws it, posed by qpos, followed by a camera like the skeleton's.

Without a screen this needs EGL (or OSMesa); `MUJOCO_GL` is honoured, but not needed: MuJoCo reads
it when it is imported, which is long before the first picture is requested.
"""

import contextlib
import importlib
import os
import sys
from pathlib import Path
from types import TracebackType
from typing import Any

import cv2
import mujoco
import numpy as np
from jaxtyping import Float

from robojackson.errors import MissingDependency
from robojackson.report.video import canvas
from robojackson.report.video.panel_camera import PITCH, Framing
from robojackson.report.video.robot_scene import Tint, dressed, furnish, on_backdrop

LINUX_BACKENDS = ("egl", "osmesa")
GRAPHICS_INSTALL = (
    "apt-get install --no-install-recommends libegl1 libgles2 libopengl0 libgl1-mesa-dri"
)
REFERENCE_TINT: Tint = (0.55, 0.66, 0.86)
TRAINED_TINT: Tint = (0.93, 0.62, 0.33)
"""RGB 0..1."""
FINER = 2
"""Drawn pixels for each pixel of the result, along an edge: smoother than the renderer's
multisampling and, with a software renderer, twice as fast."""


def chosen_backend() -> str:
    """Return what `MUJOCO_GL` names, in small letters; empty if it names none."""
    return os.environ.get("MUJOCO_GL", "").lower()


class RobotView:
    """An off-screen camera for one model; use it in a `with` block.

    Raises:
        MissingDependency: no way to draw without a screen.
    """

    def __init__(self, model: mujoco.MjModel, width: int, height: int, tint: Tint) -> None:
        self._size, size = (width, height), (FINER * width, FINER * height)
        self.model = dressed(model, *size, tint)
        self._data = mujoco.MjData(self.model)
        self._gl = _gl_context(*size)
        self._gl.make_current()
        self._context = _renderer(self.model)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN.value, self._context)
        self._scene = mujoco.MjvScene(self.model, maxgeom=2000)
        flags = mujoco.mjtRndFlag
        for flag in (flags.mjRND_REFLECTION, flags.mjRND_SHADOW, flags.mjRND_SKYBOX):
            self._scene.flags[flag] = 0
        self._camera, self._options = mujoco.MjvCamera(), mujoco.MjvOption()
        self._options.sitegroup[:] = 0
        self._rect = mujoco.MjrRect(0, 0, *size)

    def picture(
        self,
        qpos: Float[np.ndarray, " nq"],
        target: Float[np.ndarray, "2"],
        azimuth_deg: float,
        framing: Framing | None = None,
    ) -> canvas.Picture:
        """Return the robot in a pose, the camera looking at a place on the floor."""
        self._data.qpos[:] = qpos
        mujoco.mj_kinematics(self.model, self._data)
        mujoco.mj_comPos(self.model, self._data)
        self._aim(target, azimuth_deg, framing or Framing())
        self._gl.make_current()
        everything = mujoco.mjtCatBit.mjCAT_ALL.value
        mujoco.mjv_updateScene(
            self.model, self._data, self._options, None, self._camera, everything, self._scene
        )
        furnish(self._scene, self.model, self._data, target)
        mujoco.mjr_render(self._rect, self._scene, self._context)
        out = np.empty((self._rect.height, self._rect.width, 3), np.uint8)
        depth = np.empty((self._rect.height, self._rect.width), np.float32)
        mujoco.mjr_readPixels(out, depth, self._rect, self._context)
        picture = cv2.resize(on_backdrop(out, depth), self._size, interpolation=cv2.INTER_AREA)
        return np.ascontiguousarray(picture[::-1])

    def close(self) -> None:
        """Free the resources of the graphics driver."""
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

    def _aim(self, target: Float[np.ndarray, "2"], azimuth_deg: float, framing: Framing) -> None:
        self._camera.lookat[:] = [*target, framing.look_at_height]
        self._camera.distance = framing.distance
        self._camera.azimuth = 180.0 + azimuth_deg
        self._camera.elevation = -float(np.degrees(PITCH))


def _renderer(model: mujoco.MjModel) -> mujoco.MjrContext:
    """Return MuJoCo's renderer in the present context; GLFW's is none where there is no screen."""
    try:
        return mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_100.value)
    except mujoco.FatalError as cause:
        hint = "MUJOCO_GL=glfw needs a screen: unset it, or " if chosen_backend() == "glfw" else ""
        message = f"no off-screen graphics ({cause}): {hint}{GRAPHICS_INSTALL}"
        raise MissingDependency(message) from cause


def _load_triton_first() -> None:
    """Import triton before graphics, or never in this process.

    PyTorch's CUDA build imports triton, whose LLVM ends the process with a segmentation fault if
    Mesa's software renderer has loaded its own LLVM before; the other order works. Where Mesa came
    first, with MediaPipe for example, triton cannot be imported any more, and PyTorch does without.
    """
    if "triton" in sys.modules:
        return
    if _has_llvm():
        sys.modules["triton"] = None  # type: ignore[assignment]
        return
    with contextlib.suppress(ImportError):
        importlib.import_module("triton")


def _has_llvm() -> bool:
    """Return whether this process has loaded a shared library of LLVM."""
    try:
        return "/libLLVM" in Path("/proc/self/maps").read_text()
    except OSError:
        return False


def _gl_context(width: int, height: int) -> Any:
    """Return a context of the first backend that works."""
    _load_triton_first()
    chosen = chosen_backend()
    if sys.platform != "linux" or chosen == "glfw":
        return mujoco.GLContext(width, height)
    reasons = []
    for backend in (chosen,) if chosen in LINUX_BACKENDS else LINUX_BACKENDS:
        try:
            return importlib.import_module(f"mujoco.{backend}").GLContext(width, height)
        except Exception as error:  # each backend has its own exceptions for a missing library
            reasons.append(f"{backend}: {error}")
    raise MissingDependency(f"no off-screen graphics ({'; '.join(reasons)}): {GRAPHICS_INSTALL}")
