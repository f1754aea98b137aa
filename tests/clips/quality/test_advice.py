"""Advice comes from the figures of a clip; each kind appears beyond its limit and not before."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from robojackson.clips.quality.advice import LIMITS, Advice, advise
from robojackson.clips.quality.picture_quality import PictureQuality, detail_share
from robojackson.files import tables
from robojackson.motion.landmark_track import LandmarkTrack

FRAMES, WIDTH, HEIGHT = 90, 640, 480


def good_track() -> LandmarkTrack:
    """Return three seconds of one person, 336 pixels tall, in good light."""
    rng = np.random.default_rng(4)
    landmarks = rng.uniform(0.3, 0.7, (FRAMES, 33, 3))
    landmarks[:, 0, 1], landmarks[:, 28, 1] = 0.15, 0.85
    return LandmarkTrack(
        30.0, WIDTH, HEIGHT, landmarks, landmarks, np.ones((FRAMES, 33)),
        brightness=0.5, sharpness=0.5,
    )  # fmt: skip


def kinds(track: LandmarkTrack) -> dict[str, float]:
    return {each.kind: each.value for each in advise(track)}


def lost(track: LandmarkTrack, frames: int) -> LandmarkTrack:
    landmarks = track.landmarks.copy()
    landmarks[:frames] = np.nan
    return replace(track, landmarks=landmarks)


def moved(track: LandmarkTrack, pixels: float) -> LandmarkTrack:
    to_first = np.tile(np.eye(3), (FRAMES, 1, 1))
    to_first[:, 0, 2] = np.linspace(0.0, pixels, FRAMES)
    return replace(track, to_first=to_first)


def outside(track: LandmarkTrack, frames: int) -> LandmarkTrack:
    landmarks = track.landmarks.copy()
    landmarks[:frames, 27, 1] = 1.05
    return replace(track, landmarks=landmarks)


def test_a_good_clip_gets_no_advice() -> None:
    assert advise(good_track()) == ()


@pytest.mark.parametrize(
    ("track", "kind", "value"),
    [
        (replace(good_track(), fps=10.0), "frame_rate", 10.0),
        (replace(good_track(), fps=60.0), "too_short", 1.5),
        (replace(good_track(), height=150), "person_small", 105.0),
        (outside(good_track(), 45), "body_outside", 0.5),
        (lost(good_track(), 45), "person_missing", 0.5),
        (replace(good_track(), people=3, person=1), "people", 3.0),
        (moved(good_track(), 80.0), "camera_moves", 0.1),
        (replace(good_track(), brightness=0.08), "dark", 0.08),
        (replace(good_track(), sharpness=0.07), "blurred", 0.07),
    ],
)
def test_what_is_wrong_with_a_clip_is_advised_with_its_figure(
    track: LandmarkTrack, kind: str, value: float
) -> None:
    assert kinds(track) == {kind: pytest.approx(value, abs=1e-6)}


def test_nothing_is_advised_of_what_was_not_measured() -> None:
    assert advise(replace(good_track(), brightness=None, sharpness=None)) == ()


def test_a_clip_without_anybody_says_that_only() -> None:
    track = replace(good_track(), landmarks=np.full((FRAMES, 33, 3), np.nan))
    assert kinds(track) == {"person_missing": 0.0}


def test_ten_frames_a_second_are_reported_in_these_words() -> None:
    (found,) = advise(replace(good_track(), fps=10.0))
    assert str(found) == "10 frames a second: film at 30"


@pytest.mark.parametrize("kind", LIMITS)
def test_every_kind_has_words_with_its_figure(kind: str) -> None:
    result = Advice(kind, 7.0, LIMITS[kind]).record  # type: ignore[arg-type]
    assert result["kind"] == kind
    assert "7" in result["words"]


def test_a_table_keeps_what_advice_is_made_of() -> None:
    track = replace(good_track(), people=2, person=1, brightness=0.1)
    again = tables.decode(LandmarkTrack, tables.encode(track), "landmarks")
    assert advise(again) == advise(track)


def test_a_table_of_an_earlier_version_has_no_such_figures() -> None:
    columns, facts = good_track().to_columns()
    for name in ("people", "brightness", "sharpness"):
        facts.pop(name)
    again = LandmarkTrack.from_columns(columns, facts)
    assert (again.people, again.brightness, again.sharpness) == (0, None, None)


def pictures(blur: float, gain: float) -> list[np.ndarray]:
    """Return coloured patches with sharp borders, as clothes have."""
    rng = np.random.default_rng(8)
    patches = rng.integers(0, 256, (24, 32, 3)).astype(np.uint8)
    image = cv2.resize(patches, (WIDTH, HEIGHT), interpolation=cv2.INTER_NEAREST)
    if blur:
        image = cv2.GaussianBlur(image, (0, 0), blur)
    return [(image * gain).astype(np.uint8)] * FRAMES


@pytest.mark.parametrize(
    ("blur", "gain", "found"),
    [(0.0, 1.0, set()), (6.0, 1.0, {"blurred"}), (0.0, 0.2, {"dark"})],
)
def test_pictures_are_measured_around_the_person(blur: float, gain: float, found: set[str]) -> None:
    track = good_track()
    looks = PictureQuality()
    for image, row in zip(pictures(blur, gain), track.landmarks, strict=True):
        looks.add_frame(image, row[:, :2])
    seen = replace(track, brightness=looks.brightness, sharpness=looks.sharpness)
    assert set(kinds(seen)) == found


def test_sharpness_does_not_depend_on_light() -> None:
    grey = np.random.default_rng(3).integers(0, 200, (192, 100)).astype(np.uint8)
    assert detail_share(grey // 2) == pytest.approx(detail_share(grey), rel=0.02)


def test_a_person_who_is_missing_gets_the_range_in_which_he_is_in_sight() -> None:
    track = good_track()
    landmarks = track.landmarks.copy()
    landmarks[:20] = landmarks[50:55] = np.nan
    (advice,) = advise(replace(track, landmarks=landmarks))
    assert advice.range_s == pytest.approx((20 / 30, 89 / 30))
    assert "--end (in sight from 0.7 to 3.0 s)" in str(advice)
    assert advice.record["range_s"] == list(advice.range_s or ())


def test_no_range_is_named_where_none_is_long_enough() -> None:
    track = good_track()
    landmarks = track.landmarks.copy()
    landmarks[30:60] = np.nan
    (advice,) = advise(replace(track, landmarks=landmarks))
    assert advice.range_s is None
    assert "in sight" not in str(advice)
    assert set(advice.record) == {"kind", "value", "limit", "words"}


def test_a_pause_of_the_camera_is_a_part_without_the_person() -> None:
    times = np.arange(FRAMES) / 30.0 + np.where(np.arange(FRAMES) < 20, 0.0, 4.0)
    found = {each.kind: each for each in advise(replace(good_track(), time_s=times))}
    assert found["person_missing"].value == pytest.approx(90 / 210, abs=0.01)
    assert found["person_missing"].range_s == pytest.approx(
        (20 / 30 + 4.0, 89 / 30 + 4.0), abs=0.04
    )
