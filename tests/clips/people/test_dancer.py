"""Laws of following one of several: never another; an impossible number lists the people there."""

from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from robojackson.clips.people import dancer
from robojackson.clips.people.dancer import (
    DancerConfig,
    checked,
    mask_others,
    near_known,
    track_dancer,
)
from robojackson.clips.people.people_picture import best_frame
from robojackson.clips.people.tracked_people import TrackedPeople, track_people
from robojackson.clips.pose_detector import detect
from robojackson.clips.trim import trim
from robojackson.clips.video import VideoInfo, VideoLimits, probe
from robojackson.errors import NoPersonFound
from tests.fixtures.crossing import write_crossing
from tests.fixtures.made_people import SIZE, hips_x, row_of

pytestmark = pytest.mark.xdist_group("dancer")

CLIPS = Path(__file__).parents[3] / "clips"
FRAMES = 56
TIMES = np.arange(10) / 10.0
FULL = np.array([row_of(100 + i) for i in range(10)])
FAR = np.array([row_of(500) for _ in range(10)])


class Crossed(NamedTuple):
    """A clip of two who cross, where their hips are, and who was found in it."""

    path: Path
    info: VideoInfo
    places: np.ndarray
    cast: TrackedPeople


@pytest.fixture(scope="module")
def crossed(tmp_path_factory: pytest.TempPathFactory) -> Crossed:
    path = tmp_path_factory.mktemp("crossing") / "crossing.mp4"
    places = write_crossing(path, FRAMES)
    info, config = probe(path, VideoLimits()), DancerConfig()
    return Crossed(path, info, places, track_people(path, info, config.detection, config.identity))


def gap(rows: np.ndarray, begin: int, end: int) -> np.ndarray:
    holed = rows.copy()
    holed[begin:end] = np.nan
    return holed


def test_a_row_of_another_person_is_not_taken() -> None:
    found = FULL.copy()
    found[4] = FAR[4]
    assert hips_x(checked(found, [FULL], 0, TIMES, SIZE, DancerConfig())) == pytest.approx(
        100 + np.arange(10)
    )


def test_a_gap_is_filled_from_what_was_found_on_the_way() -> None:
    result = checked(FULL, [gap(FULL, 3, 6), FAR], 0, TIMES, SIZE, DancerConfig())
    assert hips_x(result) == pytest.approx(100 + np.arange(10))


def test_a_gap_beside_another_person_stays() -> None:
    beside = np.array([row_of(130) for _ in range(10)])
    result = checked(FULL, [gap(FULL, 3, 6), beside], 0, TIMES, SIZE, DancerConfig())
    assert np.isnan(hips_x(result)[3:6]).all()


def test_a_long_absence_is_not_searched() -> None:
    near = near_known(gap(FULL, 3, 9), TIMES, 0.25)
    assert near.tolist() == [True] * 5 + [False] * 2 + [True] * 3


def test_others_are_painted_over_and_the_dancer_is_not() -> None:
    image = np.random.default_rng(0).integers(0, 255, (480, 640, 3), np.uint8)
    clear = mask_others(image, row_of(150), row_of(450)[None], 0.07)
    changed = (clear != image).any(-1)
    assert changed[140:340, 430:470].mean() > 0.4
    assert not changed[:, :300].any()


def test_the_picture_shows_the_frame_with_most_people() -> None:
    info = VideoInfo(Path("x.mp4"), *SIZE, 10.0, 10, 1.0, 0)
    assert best_frame(TrackedPeople([FULL, gap(FAR, 0, 7)], TIMES, info)) == 7


def whose(rows: np.ndarray, places: np.ndarray) -> tuple[set[int], float]:
    """Return which of the two dancers a track shows while they are apart, and in which share of
    frames."""
    hips = rows[:, [23, 24], :2].mean(1) * SIZE
    apart = np.linalg.norm(places[:, 0] - places[:, 1], axis=-1) > 40
    known = ~np.isnan(hips[:, 0]) & apart
    nearest = np.linalg.norm(hips[:, None] - places, axis=-1).argmin(1)[known]
    return set(nearest.tolist()), known.sum() / apart.sum()


@pytest.mark.medium
def test_two_who_cross_in_the_same_clothes_are_distinguished(crossed: Crossed) -> None:
    shown = [whose(rows, crossed.places) for rows in crossed.cast.rows]
    assert sorted(people for people, _ in shown) == [{0}, {1}]
    assert min(share for _, share in shown) > 0.85


@pytest.mark.slow
def test_the_dancer_is_never_exchanged(crossed: Crossed) -> None:
    track = track_dancer(crossed.path, crossed.info, "lite", DancerConfig())
    people, share = whose(track.landmarks, crossed.places)
    assert len(people) == 1
    assert share > 0.85
    assert track.person == 1


@pytest.mark.medium
def test_an_impossible_number_lists_who_is_there(
    crossed: Crossed, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(dancer, "track_people", lambda *_: crossed.cast)
    with pytest.raises(NoPersonFound, match=r"no person 7 among 2: 1 \(\d+ px tall.*; 2 \("):
        track_dancer(crossed.path, crossed.info, "lite", replace(DancerConfig(), number=7))


@pytest.mark.medium
def test_people_of_a_range_are_named_at_the_moments_of_their_video(crossed: Crossed) -> None:
    later = replace(crossed.cast, info=replace(crossed.info, begin_s=40.0))
    assert [person.from_s < 1.0 for person in crossed.cast.people] == [True, True]
    assert str(later).count(", 40.") == 2


@pytest.mark.medium
def test_one_who_is_alone_is_seen_as_ever(tmp_path: Path) -> None:
    path = trim(CLIPS / "walk.mp4", 0.0, 0.5, tmp_path / "part.mp4")
    info = probe(path, VideoLimits())
    track = track_dancer(path, info, "lite", DancerConfig())
    assert np.array_equal(track.landmarks, detect(path, info, "lite").landmarks, equal_nan=True)
    assert (track.person, track.notes) == (0, ())
