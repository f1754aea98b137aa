"""Laws of the camera's path: a pan is measured, a person is no background, a cut is reported."""

from collections.abc import Callable

import cv2
import numpy as np
import pytest

from robojackson.clips.people.camera_path import CameraPath, camera_path, warp

WIDTH, HEIGHT, FRAMES = 320, 240, 40
NO_PERSON = np.full((FRAMES, 33, 2), np.nan)


def wall(seed: int = 0) -> np.ndarray:
    """Return a large picture with blots all over it, RGB."""
    rng = np.random.default_rng(seed)
    rough = rng.uniform(0, 255, size=(3 * HEIGHT, 3 * WIDTH)).astype(np.float32)
    grey = cv2.normalize(cv2.GaussianBlur(rough, (0, 0), 4.0), None, 0, 255, cv2.NORM_MINMAX)
    return np.repeat(grey.astype(np.uint8)[..., None], 3, axis=2)


def view(picture: np.ndarray, x: int, y: int = HEIGHT) -> np.ndarray:
    return np.ascontiguousarray(picture[y : y + HEIGHT, x : x + WIDTH])


def path_of(images: list[np.ndarray]) -> CameraPath:
    return camera_path(images, NO_PERSON[: len(images)], WIDTH, HEIGHT)


def test_a_camera_that_stands_is_reported_to_stand() -> None:
    found = path_of([view(wall(), WIDTH)] * FRAMES)
    assert not found.moved
    assert found.notes == ()
    assert np.allclose(found.to_first, np.eye(3))


def test_a_pan_is_measured_and_reported() -> None:
    offsets = WIDTH + np.round(np.linspace(0, 120, FRAMES)).astype(int)
    found = path_of([view(wall(), x) for x in offsets])
    middle = np.tile([[WIDTH / 2.0, HEIGHT / 2.0]], (FRAMES, 1, 1))
    shift = warp(middle, found.to_first)[:, 0] - middle[:, 0]
    assert np.allclose(shift[:, 0], offsets - offsets[0], atol=1.0)
    assert np.allclose(shift[:, 1], 0.0, atol=1.0)
    assert "the camera moved by 30%" in found.notes[0]


def test_a_zoom_is_measured() -> None:
    picture, images = wall(), []
    for factor in np.linspace(1.0, 1.3, FRAMES):
        turn = cv2.getRotationMatrix2D((1.5 * WIDTH, 1.5 * HEIGHT), 0.0, factor)
        larger = cv2.warpAffine(picture, turn, picture.shape[1::-1])
        images.append(view(larger, WIDTH))
    found = path_of(images).to_first[-1]
    assert found[0, 0] / found[2, 2] == pytest.approx(1.0 / 1.3, rel=0.01)


def test_the_measure_is_in_pixels_of_the_full_image() -> None:
    images = [view(wall(), WIDTH + step) for step in range(FRAMES)]
    found = camera_path(images, NO_PERSON, 2 * WIDTH, 2 * HEIGHT)
    assert found.to_first[-1][0, 2] == pytest.approx(2.0 * (FRAMES - 1), abs=2.0)


def test_a_person_who_moves_is_no_background() -> None:
    blots, images, marks = wall(1), [], np.tile(NO_PERSON[:1], (FRAMES, 1, 1))
    for step in range(FRAMES):
        image = view(wall(), WIDTH)
        image[60:200, 60 + 4 * step : 120 + 4 * step] = blots[:140, :60]
        images.append(image)
        corners = np.array([[60 + 4 * step, 60], [120 + 4 * step, 200]]) / [WIDTH, HEIGHT]
        marks[step] = np.linspace(corners[0], corners[1], 33)
    assert not camera_path(images, marks, WIDTH, HEIGHT).moved


def test_a_cut_is_reported() -> None:
    images = [view(wall(0), WIDTH)] * 20 + [view(wall(9), WIDTH)] * 20
    found = path_of(images)
    assert np.flatnonzero(found.jumps).tolist() == [20]
    assert "jumps in 1 of 40 frames (first: 20)" in found.notes[0]


@pytest.mark.medium
def test_a_violent_shake_is_reported() -> None:
    rng = np.random.default_rng(2)
    picture = wall()
    images = [
        view(picture, *(int(c) for c in rng.integers([100, 100], [500, 400])))
        for _ in range(FRAMES)
    ]
    assert "violent shake" in path_of(images).notes[0]


def test_a_bare_wall_is_reported_to_show_nothing() -> None:
    bare = np.full((HEIGHT, WIDTH, 3), 127, np.uint8)
    assert "cannot be seen" in path_of([bare] * FRAMES).notes[0]


def floor_and_sky(seed: int = 0) -> np.ndarray:
    """Return a picture with little texture: a plain sky over a floor with a few faint tiles, and
    noise."""
    image = np.full((HEIGHT, WIDTH), 180, np.uint8)
    image[HEIGHT // 2 :] = 140
    for x in range(20, WIDTH, 90):
        image[HEIGHT // 2 + 30 : HEIGHT // 2 + 60, x : x + 40] = 125
    noise = np.random.default_rng(seed).normal(scale=2.0, size=image.shape)
    return np.repeat(np.clip(image + noise, 0, 255).astype(np.uint8)[..., None], 3, axis=2)


def walker_at(x: int) -> np.ndarray:
    """Return the landmarks of a person 60 pixels wide."""
    corners = np.array([[x, 40], [x + 60, 200]]) / [WIDTH, HEIGHT]
    return np.linspace(corners[0], corners[1], 33)


def test_a_standing_camera_before_little_texture_moves_and_reports_nothing() -> None:
    found = path_of([floor_and_sky(seed) for seed in range(FRAMES)])
    assert found.notes == ()
    assert np.allclose(found.to_first, np.eye(3))


def tiles(seed: int = 0) -> np.ndarray:
    """Return a plain sky over a floor of tiles."""
    image = floor_and_sky(seed)
    rows, columns = np.indices(image.shape[:2])
    dark = (rows // 16 + columns // 20) % 2 == 1
    image[dark & (rows >= HEIGHT // 2)] -= 30
    return image


@pytest.mark.parametrize("background", [wall, tiles])
def test_another_person_who_walks_through_is_no_motion_of_the_camera(
    background: Callable[[int], np.ndarray],
) -> None:
    blots, images, marks = wall(1), [], []
    for step in range(FRAMES):
        image = background(0)[-HEIGHT:, -WIDTH:].copy()
        image[40:200, 30:90] = blots[100:260, 100:160]
        other = 60 + 4 * step
        image[30:220, other : other + 80] = blots[300:490, 200:280]
        images.append(image)
        marks.append(walker_at(30))
    found = camera_path(images, np.array(marks), WIDTH, HEIGHT)
    assert found.notes == ()
    assert np.allclose(found.to_first, np.eye(3))
