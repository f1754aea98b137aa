"""A view of a robot that draws in its own thread, so that the panels of a film share the cores."""

import sys
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, nullcontext
from functools import partial
from typing import ParamSpec, TypeVar

import mujoco

from robojackson.report.video.canvas import Picture
from robojackson.report.video.robot_panel import RobotView, chosen_backend
from robojackson.report.video.robot_scene import Tint

P = ParamSpec("P")
R = TypeVar("R")
BeginPicture = Callable[..., Callable[[], Picture]]
"""Function with the arguments of `RobotView.picture` that begins to draw, and returns a function
that waits for the picture."""


def can_draw_in_threads() -> bool:
    """Return whether a graphics context may live in another thread than the first: GLFW's may
    not."""
    return sys.platform == "linux" and chosen_backend() != "glfw"


@contextmanager
def threaded_view(
    model: mujoco.MjModel, width: int, height: int, tint: Tint
) -> Iterator[BeginPicture]:
    """Open a `RobotView` whose graphics context belongs to one thread.

    Raises:
        MissingDependency: no way to draw without a screen.
    """
    with ThreadPoolExecutor(1) if can_draw_in_threads() else nullcontext() as thread:

        def begun(work: Callable[P, R], *given: P.args, **named: P.kwargs) -> Callable[[], R]:
            if thread is None:
                return partial(work, *given, **named)
            return thread.submit(work, *given, **named).result

        view = begun(RobotView, model, width, height, tint)()
        try:
            yield lambda *given: begun(view.picture, *given)
        finally:
            begun(view.close)()
