"""Cameras of a page's panes: two robots are as large as each other, and none leaves its pane."""

import numpy as np
import pytest

from robojackson.report.video.panel_camera import smooth_camera_path
from robojackson.report.web.pane_camera import MARGIN_M, followed, followed_beside

FPS, COUNT = 30.0, 120
REACH, LYING = 0.5, 0.9
"""Half the width of a body that stands and of one that lies, metres."""


def body(half: np.ndarray, along: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return two points of half a width beside a root, and the root's path."""
    root = np.column_stack([along, np.zeros(COUNT), np.full(COUNT, 0.9)])
    side = np.column_stack([np.zeros(COUNT), half, np.zeros(COUNT)])
    return np.stack([root - side, root + side], 1), root


@pytest.fixture
def standing() -> tuple[np.ndarray, np.ndarray]:
    return body(np.full(COUNT, REACH), np.zeros(COUNT))


@pytest.fixture
def falling() -> tuple[np.ndarray, np.ndarray]:
    """Return a body that begins to lie at the middle of the film."""
    lies = np.arange(COUNT) >= COUNT // 2
    return body(np.where(lies, LYING, REACH), np.zeros(COUNT))


def test_a_camera_is_as_wide_as_its_subject(standing: tuple[np.ndarray, np.ndarray]) -> None:
    assert followed(*standing, FPS).widths == pytest.approx(2 * (REACH + MARGIN_M))


def test_a_robot_that_dances_is_as_large_as_its_reference(
    standing: tuple[np.ndarray, np.ndarray],
) -> None:
    camera = followed(*standing, FPS)
    points, root = standing
    beside = followed_beside(points * [1.0, 0.8, 1.0], root, FPS, camera)
    assert beside.widths == pytest.approx(camera.widths)
    assert beside.height == camera.height


def test_a_robot_that_falls_is_as_large_until_then_and_never_cut(
    standing: tuple[np.ndarray, np.ndarray], falling: tuple[np.ndarray, np.ndarray]
) -> None:
    camera = followed(*standing, FPS)
    beside = followed_beside(*falling, FPS, camera)
    assert beside.widths[:20] == pytest.approx(camera.widths[:20])
    points, root = falling
    away = np.linalg.norm(points[..., :2] - smooth_camera_path(root, FPS)[:, None], axis=-1)
    assert (beside.widths >= 2 * away.max(1)).all()
    assert np.abs(np.diff(beside.widths)).max() < 0.1
