"""Geometry of the panels: what stands where in the picture."""

import os
import subprocess
import sys
from pathlib import Path

import mujoco
import numpy as np
import pytest

from robojackson.motion.smpl_sequence import SmplSequence
from robojackson.report.video import canvas
from robojackson.report.video.panel_camera import (
    CAMERA_HEIGHT,
    DISTANCE,
    FOCAL,
    LOOK_AT_HEIGHT,
    view_of,
)
from robojackson.report.video.robot_panel import RobotView
from robojackson.report.video.skeleton_panel import skeleton_panel
from tests.fixtures.commands import ROOT, environment

TINT = (1.0, 0.0, 0.0)
FRONT = view_of(np.zeros(2), 0.0, 320, 480)


def red_columns(picture: np.ndarray) -> np.ndarray:
    red = picture[..., 0].astype(int) - picture[..., 1:].max(-1)
    return np.flatnonzero((red > 60).any(0))


def test_crop_box_holds_every_point() -> None:
    points = np.random.default_rng(2).uniform(50, 200, (40, 2))
    left, top, width, height = canvas.crop_box(points, (400, 300), 2 / 3)
    inside = (points >= [left, top]) & (points <= [left + width, top + height])
    assert inside.all()


def test_crop_box_has_the_requested_shape() -> None:
    points = np.random.default_rng(2).uniform(50, 200, (40, 2))
    _, _, width, height = canvas.crop_box(points, (400, 300), 2 / 3)
    assert width / height == pytest.approx(2 / 3, abs=0.01)


def test_crop_box_without_a_person_holds_the_whole_image() -> None:
    left, top, width, height = canvas.crop_box(np.full((4, 2), np.nan), (400, 300), 2 / 3)
    assert left <= 0
    assert top <= 0
    assert left + width >= 400
    assert top + height >= 300


def test_cut_brings_a_point_to_its_place() -> None:
    image = np.zeros((100, 100, 3), np.uint8)
    image[40:44, 60:64] = 255
    panel = canvas.cut(image, (50, 30, 40, 40), (80, 80))
    rows, columns = np.nonzero(panel[..., 0] > 128)
    np.testing.assert_allclose([columns.mean(), rows.mean()], [23.5, 23.5], atol=1.0)


def test_a_line_to_nowhere_draws_nothing() -> None:
    picture = np.zeros((20, 20, 3), np.uint8)
    canvas.draw_line(picture, np.array([3.0, 3.0]), np.array([np.nan, 9.0]), (255, 255, 255), 2)
    assert not picture.any()


def test_camera_looks_at_its_target() -> None:
    np.testing.assert_allclose(FRONT.project(np.array([0.0, 0.0, LOOK_AT_HEIGHT])), [160, 240])


def test_left_of_the_person_is_at_the_right_of_the_picture() -> None:
    assert FRONT.project(np.array([0.0, 0.5, LOOK_AT_HEIGHT]))[0] > 160


def test_size_in_the_picture_follows_the_pinhole() -> None:
    side = FRONT.project(np.array([0.0, 0.5, LOOK_AT_HEIGHT]))[0] - 160
    depth = np.hypot(DISTANCE, CAMERA_HEIGHT - LOOK_AT_HEIGHT)
    assert side == pytest.approx(FOCAL * 480 * 0.5 / depth)


def test_point_behind_the_camera_is_not_drawn() -> None:
    assert np.isnan(FRONT.project(np.array([DISTANCE + 1.0, 0.0, 1.0]))).all()


def test_skeleton_shows_both_sides_in_their_colours(sequence: SmplSequence) -> None:
    panel = skeleton_panel(sequence.keypoints_w[0], sequence.contact[0], FRONT, 320, 480)
    panel = panel.reshape(-1, 3)
    for colour in (canvas.LEFT, canvas.RIGHT, canvas.MIDDLE):
        assert (np.abs(panel.astype(int) - colour).max(1) < 8).any()


def test_robot_that_steps_left_goes_right_in_the_picture(model: mujoco.MjModel) -> None:
    qpos = model.qpos0.copy()
    with RobotView(model, 160, 240, TINT) as view:
        before = red_columns(view.picture(qpos, np.zeros(2), 0.0)).mean()
        qpos[1] += 0.3
        after = red_columns(view.picture(qpos, np.zeros(2), 0.0)).mean()
    assert after > before + 10


def test_camera_that_follows_keeps_the_robot_in_the_middle(model: mujoco.MjModel) -> None:
    qpos = model.qpos0.copy()
    qpos[:2] = [3.0, -2.0]
    with RobotView(model, 160, 240, TINT) as view:
        columns = red_columns(view.picture(qpos, qpos[:2], 0.0))
    assert columns.mean() == pytest.approx(80, abs=4)


@pytest.mark.medium
def test_drawing_leaves_the_model_as_it_was(model: mujoco.MjModel) -> None:
    before = model.geom_rgba.copy(), model.tex_data.copy(), model.vis.global_.fovy
    with RobotView(model, 64, 96, TINT) as view:
        view.picture(model.qpos0, np.zeros(2), 0.0)
    np.testing.assert_array_equal(before[0], model.geom_rgba)
    np.testing.assert_array_equal(before[1], model.tex_data)
    assert before[2] == model.vis.global_.fovy


DRAWN = """
import sys
from pathlib import Path
import numpy as np
from robojackson.api.robots import load_robot
from robojackson.report.video.robot_panel import RobotView

def draw():
    with RobotView(load_robot("humanoid").model, 32, 32, (1.0, 0.0, 0.0)):
        return "/libLLVM" in Path("/proc/self/maps").read_text()
"""
TRITON_FIRST = "draw(); print(sys.modules['triton'].__file__)"
MESA_FIRST = """
sys.modules["triton"] = None
loaded = draw()
del sys.modules["triton"]
draw()
print(loaded == (sys.modules["triton"] is None))
"""


def drawn(code: str, modules: Path) -> str:
    """Return what a program prints that draws in a process of its own.

    Args:
        modules: Folder with modules that are found before others.
    """
    outer = environment(PYTHONPATH=f"{modules}{os.pathsep}{ROOT}")
    done = subprocess.run(
        [sys.executable, "-c", DRAWN + code], capture_output=True, text=True, env=outer, check=True
    )
    return done.stdout.strip()


@pytest.mark.medium
def test_triton_is_loaded_before_graphics(tmp_path: Path) -> None:
    """PyTorch's CUDA build brings it; loaded after Mesa's renderer it ends the process."""
    (tmp_path / "triton.py").write_text("")
    assert drawn(TRITON_FIRST, tmp_path) == str(tmp_path / "triton.py")


@pytest.mark.medium
def test_triton_is_never_loaded_after_mesas_renderer(tmp_path: Path) -> None:
    (tmp_path / "triton.py").write_text("")
    assert drawn(MESA_FIRST, tmp_path) == "True"
