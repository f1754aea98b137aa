"""Views that draw in threads give the pictures of those that do not, and leave no thread behind."""

import threading

import mujoco
import numpy as np
import pytest

from robojackson.errors import MissingDependency
from robojackson.report.video import robot_panel, threaded_view
from robojackson.report.video.panel_camera import Framing
from robojackson.report.video.robot_panel import REFERENCE_TINT, TRAINED_TINT, RobotView
from robojackson.report.video.threaded_view import threaded_view as opened
from tests.fixtures.robots import stock

SIZE = (96, 144)


@pytest.fixture(scope="module")
def model() -> mujoco.MjModel:
    return stock().model


@pytest.mark.parametrize("threads", [True, False])
def test_two_views_at_once_draw_what_each_draws_alone(
    model: mujoco.MjModel, monkeypatch: pytest.MonkeyPatch, threads: bool
) -> None:
    monkeypatch.setattr(threaded_view, "can_draw_in_threads", lambda: threads)
    poses = [model.qpos0 + 0.1 * k * np.eye(model.nq)[7] for k in range(4)]
    alone = []
    for tint in (REFERENCE_TINT, TRAINED_TINT):
        with RobotView(model, *SIZE, tint) as view:
            alone.append([view.picture(qpos, np.zeros(2), 0.0) for qpos in poses])
    before = threading.active_count()
    with (
        opened(model, *SIZE, REFERENCE_TINT) as left,
        opened(model, *SIZE, TRAINED_TINT) as right,
    ):
        begun = [[begin(qpos, np.zeros(2), 0.0, Framing()) for qpos in poses]
                 for begin in (left, right)]  # fmt: skip
        pictures = [[wait() for wait in waits] for waits in begun]
        assert threading.active_count() - before == 2 * threads
    np.testing.assert_array_equal(pictures, alone)
    assert not np.array_equal(pictures[0][0], pictures[0][3])
    assert threading.active_count() == before


def test_missing_graphics_are_named_and_end_the_thread(
    model: mujoco.MjModel, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*size: int) -> None:
        raise MissingDependency("no off-screen graphics")

    monkeypatch.setattr(robot_panel, "_gl_context", refuse)
    before = threading.active_count()
    with (
        pytest.raises(MissingDependency, match="no off-screen graphics"),
        opened(model, *SIZE, REFERENCE_TINT),
    ):
        pytest.fail("a view without graphics")
    assert threading.active_count() == before


def test_a_backend_that_needs_a_screen_is_named(
    model: mujoco.MjModel, monkeypatch: pytest.MonkeyPatch
) -> None:
    """GLFW gives a context that is none; MuJoCo finds out."""

    class NoContext:
        def make_current(self) -> None: ...

        def free(self) -> None: ...

    def refuse(*given: object) -> None:
        raise mujoco.FatalError("an OpenGL platform library has not been loaded")

    monkeypatch.setenv("MUJOCO_GL", "glfw")
    monkeypatch.setattr(robot_panel, "_gl_context", lambda *size: NoContext())
    monkeypatch.setattr(mujoco, "MjrContext", refuse)
    with pytest.raises(MissingDependency, match="MUJOCO_GL=glfw needs a screen: unset it"):
        RobotView(model, *SIZE, REFERENCE_TINT)
