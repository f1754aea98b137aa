"""The parts of an assessment, on pictures and tracks with known answers."""

import cv2
import numpy as np
import pytest

from robojackson.clips.people.camera_motion import CameraConfig, CameraMotion, displacement, spread
from robojackson.clips.people.person_extent import MIRROR, box, full_body, heights_px
from robojackson.clips.quality import duplicates
from robojackson.clips.quality.cuts import Changes, CutConfig, leaps, together
from robojackson.clips.quality.drawing import flat_share
from robojackson.clips.quality.duplicates import (
    DuplicateConfig,
    distance,
    find_duplicates,
    poses,
)
from robojackson.clips.rejection import Rejection
from robojackson.motion.landmark_track import LandmarkTrack

NO_PERSON = np.full((33, 2), np.nan)
SHAPE = (240, 320)


def track_of(xy: np.ndarray, visibility: float = 0.9, fps: float = 30.0) -> LandmarkTrack:
    points = np.concatenate([xy, np.zeros((*xy.shape[:2], 1))], -1)
    seen = np.where(np.isnan(xy[..., 0]), np.nan, visibility)
    return LandmarkTrack(fps, 200, 100, points, points, seen)


def dance(frames: int = 60, seed: int = 0) -> np.ndarray:
    """Return a person whose landmarks wander smoothly and independently."""
    rng = np.random.default_rng(seed)
    phase, speed = rng.uniform(0, 6.28, (33, 2)), rng.uniform(0.05, 0.15, (33, 2))
    time = np.arange(frames)[:, None, None]
    xy = rng.uniform(0.3, 0.7, (33, 2)) + 0.05 * np.sin(speed * time + phase)
    xy[:, 0, 1], xy[:, 27, 1] = 0.2, 0.8
    return xy


def noise(seed: int = 0) -> np.ndarray:
    grain = np.random.default_rng(seed).integers(0, 255, (60, 80), dtype=np.uint8)
    return cv2.resize(grain, SHAPE[::-1], interpolation=cv2.INTER_CUBIC)


def shifted(image: np.ndarray, px: float) -> np.ndarray:
    move = np.float32([[1, 0, px], [0, 1, 0]])
    return cv2.warpAffine(image, move, SHAPE[::-1], borderMode=cv2.BORDER_REFLECT)


def a_body() -> np.ndarray:
    """Return a standing person, upright in the middle of the image."""
    xy = np.full((33, 2), 0.5)
    xy[:11, 1] = 0.2
    for index, (x, y) in {
        11: (0.55, 0.3), 12: (0.45, 0.3), 13: (0.58, 0.42), 14: (0.42, 0.42), 15: (0.6, 0.5),
        16: (0.4, 0.5), 23: (0.53, 0.5), 24: (0.47, 0.5), 25: (0.53, 0.65), 26: (0.47, 0.65),
        27: (0.53, 0.8), 28: (0.47, 0.8),
    }.items():  # fmt: skip
        xy[index] = x, y
    return xy


@pytest.mark.parametrize("px", [0.0, 1.0, 4.0, 8.0])
def test_the_camera_moves_by_as_much_as_the_picture(px: float) -> None:
    before = noise()
    found = displacement(before, shifted(before, px), NO_PERSON, 120)
    assert found * np.hypot(*SHAPE) == pytest.approx(px, abs=0.15)


def test_the_person_does_not_count_as_the_camera() -> None:
    before, after = noise(), noise()
    after[60:180, 100:220] = shifted(before, 9.0)[60:180, 100:220]
    xy = np.zeros((33, 2)) + [0.5, 0.5]
    xy[0], xy[1] = (100 / 320, 60 / 240), (220 / 320, 180 / 240)
    assert displacement(before, after, xy, 120) * np.hypot(*SHAPE) < 0.1


def test_a_plain_wall_says_nothing_about_the_camera() -> None:
    wall = np.full(SHAPE, 128, np.uint8)
    assert np.isnan(displacement(wall, wall, NO_PERSON, 120))


def test_a_clip_without_background_counts_as_still() -> None:
    motion = CameraMotion(30, 30.0, CameraConfig())
    for index in range(30):
        motion.add_frame(index, np.zeros((*SHAPE, 3), np.uint8), NO_PERSON)
    assert motion.static_share == 1.0


@pytest.mark.parametrize("fps", [10.0, 30.0, 60.0, 120.0])
@pytest.mark.parametrize(("speed", "still"), [(0.06, 1.0), (0.15, 0.0)])
def test_a_camera_stands_by_its_speed_whatever_the_frame_rate(
    fps: float, speed: float, still: float
) -> None:
    motion = CameraMotion(30, fps, CameraConfig())
    motion.displacements = [speed / fps] * 8
    assert motion.static_share == still


def test_frames_are_spread_evenly() -> None:
    chosen = sorted(spread(300, 30.0, 1.0, 4))
    assert (len(chosen), set(np.diff(chosen))) == (10, {30})


@pytest.mark.parametrize("frames", [0, 1, 3, 5])
def test_a_short_clip_has_no_frame_twice_and_none_outside(frames: int) -> None:
    chosen = spread(frames, 30.0, 1.0, 4)
    assert chosen <= set(range(frames))
    assert len(chosen) == min(frames, 4)


def changes_of(images: list[np.ndarray], fps: float = 30.0) -> Changes:
    seen = Changes(fps, CutConfig())
    for image in images:
        seen.add_frame(image)
    return seen


def scene(level: int, hue: int) -> np.ndarray:
    image = np.full((96, 128, 3), level, np.uint8)
    image[..., hue] = 255
    return image


def test_cuts_are_where_the_scene_changes() -> None:
    images = [scene(20, 0)] * 20 + [scene(200, 1)] * 20 + [scene(90, 2)] * 20
    assert changes_of(images).cuts == [20, 40]


def test_a_still_does_not_move() -> None:
    assert changes_of([scene(20, 0)] * 20).moving_share == 0.0


def test_a_film_moves_in_every_frame() -> None:
    images = [np.roll(np.repeat(noise()[..., None], 3, -1), 5 * i, 1) for i in range(10)]
    assert changes_of(images).moving_share == 1.0


@pytest.mark.parametrize(("repeated", "fps"), [(4, 60.0), (5, 120.0), (8, 120.0)])
def test_a_film_whose_file_repeats_its_pictures_moves(repeated: int, fps: float) -> None:
    images = [np.roll(np.repeat(noise()[..., None], 3, -1), 5 * i, 1) for i in range(10)]
    doubled = [image for image in images for _ in range(repeated)]
    assert changes_of(doubled, fps).moving_share > 0.8


def test_a_slideshow_moves_seldom() -> None:
    images = [scene(20 + 10 * slide, slide % 3) for slide in range(4) for _ in range(30)]
    assert changes_of(images).moving_share < 0.15


def test_the_noise_of_an_encoder_is_no_motion() -> None:
    rng = np.random.default_rng(0)
    images = [scene(100, 0) - rng.integers(0, 6, (96, 128, 3)).astype(np.uint8) for _ in range(10)]
    assert changes_of(images).moving_share == 0.0


def test_a_jump_cut_is_a_leap_of_the_whole_person() -> None:
    xy = dance()
    xy[30:] += [0.3, 0.0]
    assert leaps(track_of(xy), CutConfig()) == [30]


def test_a_kick_is_no_leap() -> None:
    xy = dance()
    xy[30, 25:33] += [0.3, 0.0]
    assert leaps(track_of(xy), CutConfig()) == []


def test_a_gap_in_the_track_is_no_leap() -> None:
    xy = dance()
    xy[20:30] = np.nan
    assert leaps(track_of(xy), CutConfig()) == []


def test_a_cut_that_both_see_counts_once() -> None:
    assert together([30, 90], [31, 60], 9) == [30, 60, 90]


def test_a_mirrored_copy_is_found_whatever_its_size_and_place() -> None:
    one, other = track_of(dance()), track_of(dance(seed=9))
    turned = dance()[:, list(MIRROR)] * [-1.0, 1.0] + [1.0, 0.0]
    copy = track_of(0.5 * turned + [0.2, 0.1])
    found = find_duplicates({"one": one, "other": other, "copy": copy}, DuplicateConfig())
    assert found == {"copy": Rejection("mirrored_copy", other="one")}


def test_a_copy_that_starts_later_is_found() -> None:
    whole = dance(90)
    found = find_duplicates(
        {"whole": track_of(whole), "end": track_of(whole[30:])}, DuplicateConfig()
    )
    assert found == {"end": Rejection("copy", other="whole")}


@pytest.mark.parametrize("seconds", [2, 9, 20])
@pytest.mark.parametrize("noise_share", [0.0, 0.02, 0.06, 0.3])
def test_a_few_poses_find_the_copies_that_all_poses_find(seconds: int, noise_share: float) -> None:
    """Noise of body heights on either side of the limit, frames without a person, a delay."""
    rng, config = np.random.default_rng(seconds), DuplicateConfig()
    whole = dance(30 * (seconds + 1), seed=seconds)
    other = whole[30:] + noise_share * 0.6 * rng.uniform(-1.0, 1.0, whole[30:].shape) / [2.0, 1.0]
    other[rng.random(len(other)) < 0.2] = np.nan
    one, two = poses(track_of(whole), config.rate), poses(track_of(other), config.rate)
    all_poses = distance(two, one, config) <= config.distance
    assert bool(find_duplicates({"a": track_of(whole), "b": track_of(other)}, config)) == all_poses


def test_of_clips_that_differ_only_a_few_poses_are_compared(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Else forty clips take fifteen seconds of a core."""
    tracks = {str(seed): track_of(dance(300, seed=seed)) for seed in range(4)}
    monkeypatch.setattr(duplicates, "distance", None)  # calling it is an error
    assert find_duplicates(tracks, DuplicateConfig()) == {}


def test_clips_without_a_person_are_no_copies_of_one_another() -> None:
    empty = track_of(np.full((30, 33, 2), np.nan))
    assert find_duplicates({"a": empty, "b": empty}, DuplicateConfig()) == {}


def test_a_mirror_of_a_mirror_is_the_landmark_itself() -> None:
    assert [MIRROR[i] for i in MIRROR] == list(range(33))


@pytest.mark.parametrize(("index", "where"), [(0, [0.5, -0.1]), (27, [0.5, 1.1]), (28, [1.2, 0.8])])
def test_a_body_that_leaves_the_picture_is_not_in_full_view(index: int, where: list[float]) -> None:
    xy = np.stack([a_body(), a_body()])
    xy[1, index] = where
    assert full_body(track_of(xy), 0.5).tolist() == [True, False]


def test_a_hand_outside_does_not_matter() -> None:
    xy = a_body()[None].copy()
    xy[0, 15] = [1.3, 0.5]
    assert full_body(track_of(xy), 0.5).tolist() == [True]


def test_the_height_is_from_head_to_foot_in_pixels() -> None:
    assert heights_px(track_of(a_body()[None])) == pytest.approx([60.0])


def test_the_box_of_no_person_is_none() -> None:
    assert box(NO_PERSON, 0.1, 100, 100) is None


def test_paint_is_flat_and_cloth_is_not() -> None:
    paint = np.full((*SHAPE, 3), 128, np.uint8)
    rng = np.random.default_rng(0)
    cloth = paint + rng.integers(0, 40, paint.shape).astype(np.uint8)
    assert (flat_share(paint, a_body(), 4), round(flat_share(cloth, a_body(), 4), 2)) == (1.0, 0.0)
