"""Up and the focal length from straight edges."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from robojackson.mocap.grounding.scene_lines import SceneEvidence, scene_evidence
from robojackson.mocap.grounding.up_direction import CAMERA_UP

WIDTH, HEIGHT = 1280, 720
DIAGONAL = float(np.hypot(WIDTH, HEIGHT))


def room(turn: Rotation, focal_px: float, seed: int = 0, scattered: int = 25) -> np.ndarray:
    """Return edges of a room: 20 in each of three directions, and some at random; pixels.

    Args:
        turn: Rotation of the room before the camera.
        focal_px: Focal length, pixels.
        seed: Seed of the places and of the errors of .3 pixels.
        scattered: Number of edges at random.
    """
    rng = np.random.default_rng(seed)
    edges = []
    while len(edges) < 60:
        place = rng.uniform([-3, -2, 3], [3, 2, 9])
        along = turn.apply(np.eye(3)[len(edges) % 3]) * rng.uniform(0.4, 2.0)
        ends = np.stack([place - along / 2, place + along / 2])
        if (ends[:, 2] < 1.0).any():
            continue
        pixels = ends[:, :2] / ends[:, 2:] * focal_px + np.array([WIDTH, HEIGHT]) / 2
        if (np.abs(pixels - np.array([WIDTH, HEIGHT]) / 2) < np.array([WIDTH, HEIGHT]) / 2).all():
            edges.append((pixels + rng.normal(0.0, 0.3, (2, 2))).ravel())
    begun = rng.uniform(0, [WIDTH, HEIGHT], (scattered, 2))
    ended = begun + rng.normal(0.0, 80.0, (scattered, 2))
    return np.concatenate([np.array(edges), np.concatenate([begun, ended], 1)])


def angle_deg(one: np.ndarray, other: np.ndarray) -> float:
    return float(np.degrees(np.arccos(np.clip(one @ other, -1.0, 1.0))))


def found_in(edges: np.ndarray, near: np.ndarray) -> SceneEvidence:
    found = scene_evidence(edges, WIDTH, HEIGHT, near)
    assert found is not None
    return found


@pytest.mark.parametrize("roll", [-15.0, 0.0, 8.0])
@pytest.mark.parametrize("pitch", [-15.0, 5.0, 35.0])
@pytest.mark.parametrize("focal", [0.6, 0.85, 1.2])
def test_a_room_shows_up_and_the_focal_length(roll: float, pitch: float, focal: float) -> None:
    turn = Rotation.from_euler("yxz", [27, pitch, roll], degrees=True)
    up = turn.apply(CAMERA_UP)
    near = Rotation.from_euler("xz", [9, -6], degrees=True).apply(up)
    found = found_in(room(turn, focal * DIAGONAL), near)
    assert angle_deg(found.up, up) < 1.5
    assert angle_deg(found.up, up) < 2.0 * np.degrees(found.sd)
    assert found.sd < np.radians(6.0)
    assert found.focal_px == pytest.approx(focal * DIAGONAL, rel=0.08)


def test_mirrored_edges_give_the_mirrored_up() -> None:
    turn = Rotation.from_euler("yxz", [20, 12, 7], degrees=True)
    edges, flip = room(turn, 1000.0), np.array([-1.0, 1.0, 1.0])
    mirrored = edges * [-1, 1, -1, 1] + [WIDTH, 0, WIDTH, 0]
    one, other = found_in(edges, CAMERA_UP), found_in(mirrored, CAMERA_UP * flip)
    assert angle_deg(one.up * flip, other.up) < 0.8


@pytest.mark.parametrize("seed", range(4))
def test_edges_at_random_show_nothing_and_say_so(seed: int) -> None:
    rng = np.random.default_rng(seed)
    begun = rng.uniform(0, [WIDTH, HEIGHT], (40, 2))
    edges = np.concatenate([begun, begun + rng.normal(0.0, 90.0, (40, 2))], 1)
    found = found_in(edges, CAMERA_UP)
    assert found.sd > np.radians(6.0)
    assert found.focal_sd > 0.1


@pytest.mark.parametrize("edges", [np.eye(4)[:2], np.ones((9, 4)), np.zeros((0, 4))])
def test_two_edges_are_too_few_and_points_are_none(edges: np.ndarray) -> None:
    assert scene_evidence(edges, WIDTH, HEIGHT, CAMERA_UP) is None
