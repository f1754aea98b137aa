"""A view of a robot that draws in its own thread, so that the panels of a film share the cores."""

import os
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from types import TracebackType
from typing import ParamSpec, TypeVar

import mujoco
import numpy as np
from jaxtyping import Float

from robojackson.report.video.canvas import Picture
from robojackson.report.video.panel_camera import Framing
from robojackson.report.video.robot_panel import RobotView
from robojackson.report.video.robot_scene import Tint

P = ParamSpec("P")
R = TypeVar("R")


def can_draw_in_threads() -> bool:
    """Return whether a graphics context may live in another thread than the first: GLFW's may
    not."""
    return sys.platform == "linux" and os.environ.get("MUJOCO_GL", "").lower() != "glfw"


class ThreadedView:
    """A `RobotView` whose graphics context belongs to one thread; use it in a `with` block.

    Raises:
        MissingDependency: no way to draw without a screen.
    """

    def __init__(self, model: mujoco.MjModel, width: int, height: int, tint: Tint) -> None:
        self._thread = ThreadPoolExecutor(1) if can_draw_in_threads() else None
        try:
            self._view = self._begun(RobotView, model, width, height, tint)()
        except BaseException:
            self._end()
            raise

    def begin(
        self,
        qpos: Float[np.ndarray, " nq"],
        target: Float[np.ndarray, "2"],
        azimuth_deg: float,
        framing: Framing,
    ) -> Callable[[], Picture]:
        """Begin to draw (`RobotView.picture`); return a function that waits for the picture."""
        return self._begun(self._view.picture, qpos, target, azimuth_deg, framing)

    def __enter__(self) -> "ThreadedView":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        try:
            self._begun(self._view.close)()
        finally:
            self._end()

    def _begun(self, work: Callable[P, R], *given: P.args, **named: P.kwargs) -> Callable[[], R]:
        if self._thread is None:
            return partial(work, *given, **named)
        return self._thread.submit(work, *given, **named).result

    def _end(self) -> None:
        if self._thread is not None:
            self._thread.shutdown(cancel_futures=True)
