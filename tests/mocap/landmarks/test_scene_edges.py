"""Straight edges of the scene in a few pictures."""

import cv2
import numpy as np
import pytest

from benchmarks.mocap.truth import REAL, load_truth, video_path
from robojackson.clips.people.camera_motion import grey_levels
from robojackson.clips.video import timed_frames
from robojackson.mocap.grounding.scene_lines import scene_evidence
from robojackson.mocap.grounding.up_direction import CAMERA_UP
from robojackson.mocap.landmarks.scene_edges import PICTURES, SceneEdges, straight_edges


def drawn(*lines: tuple[int, int, int, int], size: tuple[int, int] = (480, 640)) -> np.ndarray:
    picture = np.full(size, 40, np.uint8)
    for x0, y0, x1, y1 in lines:
        cv2.line(picture, (x0, y0), (x1, y1), 220, 6, cv2.LINE_AA)
    return picture


def test_the_sides_of_a_beam_are_found_where_they_are() -> None:
    edges = straight_edges(drawn((100, 50, 140, 400)))
    assert len(edges) >= 2
    slope = (edges[:2, 2] - edges[:2, 0]) / (edges[:2, 3] - edges[:2, 1])
    assert slope == pytest.approx(40 / 350, abs=0.01)


@pytest.mark.parametrize("bar", [np.s_[:70], np.s_[-70:], np.s_[:, :60]])
def test_a_bar_at_the_border_is_no_edge_of_the_scene(bar: tuple[slice, ...]) -> None:
    picture = drawn((100, 50, 140, 400), (300, 40, 330, 430))
    picture[bar] = 0
    edges = straight_edges(picture)
    assert len(edges) == 4
    along = np.abs(edges[:, 2:] - edges[:, :2])
    assert (along[:, 1] > 5 * along[:, 0]).all()


def test_a_frame_that_is_drawn_around_the_picture_is_no_edge_of_the_scene() -> None:
    picture = drawn((100, 50, 140, 400))
    before = len(straight_edges(picture))
    picture[:, 500:] = np.random.default_rng(0).integers(80, 120, (480, 140))
    assert len(straight_edges(picture)) == before


def test_an_empty_picture_has_no_edges() -> None:
    assert straight_edges(np.zeros((120, 160), np.uint8)).shape == (0, 4)
    assert SceneEdges().edges(False, 160, 120) is None


@pytest.mark.parametrize("frames", [1, 7, 500])
def test_few_pictures_are_kept_and_spread_over_the_clip(frames: int) -> None:
    scene = SceneEdges()
    for index in range(frames):
        scene.add_frame(index, np.full((4, 4), index % 251, np.uint8))
    kept = [int(picture[0, 0]) for picture in scene._kept]
    assert len(kept) <= 2 * PICTURES
    assert len(kept) >= min(frames, PICTURES)
    assert kept[0] == 0


def test_what_moves_before_a_still_camera_leaves_no_edge() -> None:
    scene = SceneEdges()
    for index in range(9):
        x = 60 * index + 60
        scene.add_frame(index, drawn((300, 60, 320, 440), (x, 100, x + 9, 380)))
    found = scene.edges(False, 1280, 960)
    assert found is not None
    assert np.abs(found[:, [0, 2]] - 620.0).max() < 40.0
    moved = scene.edges(True, 1280, 960)
    assert moved is not None
    assert moved[:, 0].min() < 140.0


@pytest.mark.parametrize("clip", REAL)
def test_a_real_room_shows_a_rolled_camera_its_up(clip: str) -> None:
    """The cameras are pitched by 18 to 25 degrees, rolled by up to 28; up is sought near level."""
    scene, truth = SceneEdges(), load_truth(clip)
    for index, (_, image) in enumerate(timed_frames(video_path(clip))):
        if index % 20 == 0:
            scene.add_frame(index // 20, grey_levels(image))
            height, width = image.shape[:2]
    edges = scene.edges(False, width, height)
    assert edges is not None
    found = scene_evidence(edges, width, height, CAMERA_UP)
    assert found is not None
    assert np.degrees(np.arccos(found.up @ truth.up_c)) < 3.0
    assert found.sd < np.radians(6.0)
    assert found.focal_px == pytest.approx(1681.0, rel=0.06)
