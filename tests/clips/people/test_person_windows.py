"""Laws of windows: they cover, hold and follow; several people far away are found in them."""

from itertools import islice
from pathlib import Path

import cv2
import numpy as np
import pytest

from robojackson.clips.people.dancer import DancerConfig, track_dancer
from robojackson.clips.people.person_windows import (
    STAYS,
    in_picture,
    is_whole,
    tiles,
    window,
    windows,
)
from robojackson.clips.people.tracked_people import Memory, track_people
from robojackson.clips.video import VideoInfo, VideoLimits, probe
from tests.fixtures import crossing
from tests.fixtures.difficult_clips import write
from tests.fixtures.made_people import SIZE, row_of, seen

pytestmark = pytest.mark.xdist_group("person_windows")

WIDTH, HEIGHT = 1280, 720
SCALE, CORNER = 0.4, np.array([600, 400])
FRAMES = 12
"""Before the two of the fixture meet."""


@pytest.mark.parametrize("side", [48, 100, 60, 37])
def test_tiles_cover_the_picture_and_overlap_by_half(side: int) -> None:
    boxes = tiles(160, 100, side)
    covered = np.zeros((100, 160), int)
    for x0, y0, x1, y1 in boxes:
        assert 0 <= x0 < x1 <= 160
        assert 0 <= y0 < y1 <= 100
        covered[y0:y1, x0:x1] += 1
    assert covered.min() >= 1
    columns = sorted({box[0] for box in boxes})
    assert max(np.diff(columns), default=0) <= side / 2 + 1


@pytest.mark.parametrize("place", [(5.0, 5.0), (155.0, 95.0), (80.0, 50.0)])
def test_a_window_lies_inside_the_picture_and_holds_the_place(place: tuple[float, float]) -> None:
    x0, y0, x1, y1 = window(np.array(place), 60.0, (100, 160, 3))
    assert (x1 - x0, y1 - y0) == (60, 60)
    assert 0 <= x0 <= place[0] <= x1 <= 160
    assert 0 <= y0 <= place[1] <= y1 <= 100


def test_windows_follow_one_another_and_keep_the_person_in_their_middle() -> None:
    rng = np.random.default_rng(0)
    places = np.cumsum(rng.normal(scale=9.0, size=(80, 2)), axis=0) + 500.0
    start = 0
    for end, (x0, y0, x1, y1) in windows(places, 100.0, (1000, 1000)):
        middle = np.array([x0 + x1, y0 + y1]) / 2.0
        assert (np.abs(places[start:end] - middle) <= STAYS * 100.0 + 1.0).all()
        start = end
    assert start == len(places)


def test_a_person_who_stays_needs_one_window() -> None:
    assert len(list(windows(np.full((50, 2), 300.0), 100.0, (720, 1280)))) == 1


def test_landmarks_of_a_window_are_those_of_the_picture() -> None:
    row = np.full((33, 7), 0.5)
    moved = in_picture(row, (100, 20, 140, 100), 400, 200)
    assert moved[0] == pytest.approx([120 / 400, 60 / 200, 20 / 400, 0.5, 0.5, 0.5, 0.5])


def test_a_person_who_is_cut_off_is_not_whole() -> None:
    assert is_whole(row_of(320))
    assert not is_whole(row_of(5))


def test_memory_keeps_where_each_was_last_and_forgets() -> None:
    memory, info = Memory(), VideoInfo(Path("there-is-none.mp4"), *SIZE, 30.0, 10, 1 / 3, 0)
    memory.add(0.0, [seen(100), seen(500)], info)
    memory.add(0.5, [seen(130)], info)
    places = sorted(float(row[:, 0].mean() * SIZE[0]) for row in memory.of(0.5, 1.0))
    assert places == pytest.approx([130, 500], abs=2)
    assert len(memory.of(1.2, 1.0)) == 1
    assert memory.of(2.0, 1.0) == []
    memory.add(3.0, [seen(100), seen(150)], info)  # arm in arm
    assert len(memory.of(3.0, 1.0)) == 2


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, VideoInfo, np.ndarray]:
    """Two dancers of about 100 pixels in a picture of 1280 x 720, and where their hips are."""
    path = tmp_path_factory.mktemp("small") / "small.mp4"
    pictures, places = crossing.crossing()
    shown = []
    for picture in islice(pictures, FRAMES):
        whole = np.full((HEIGHT, WIDTH, 3), picture[0, 0], np.uint8)
        part = cv2.resize(picture, None, fx=SCALE, fy=SCALE, interpolation=cv2.INTER_AREA)
        x, y = CORNER
        whole[y : y + len(part), x : x + part.shape[1]] = part
        shown.append(whole)
    write(path, shown)
    return path, probe(path, VideoLimits()), places[:FRAMES] * SCALE + CORNER


@pytest.mark.medium
def test_two_people_far_away_are_found(small: tuple[Path, VideoInfo, np.ndarray]) -> None:
    path, info, places = small
    config = DancerConfig()
    cast = track_people(path, info, config.detection, config.identity)
    assert len(cast.rows) == 2
    whose = set()
    for rows in cast.rows:
        known = ~np.isnan(rows[:, 0, 0])
        assert known.mean() > 0.8
        hips = rows[known][:, [23, 24], :2].mean(1) * (WIDTH, HEIGHT)
        off = np.linalg.norm(hips[:, None] - places[known], axis=-1)
        whose.add(int(off.mean(0).argmin()))
        assert off.mean(0).min() < 10.0
    assert whose == {0, 1}


@pytest.mark.medium
def test_one_of_two_far_away_is_followed_in_windows(
    small: tuple[Path, VideoInfo, np.ndarray],
) -> None:
    path, info, places = small
    track = track_dancer(path, info, "lite", DancerConfig(number=1))
    assert track.detected.all()
    hips = track.landmarks[:, [23, 24], :2].mean(1) * (WIDTH, HEIGHT)
    off = np.linalg.norm(hips[:, None] - places, axis=-1).mean(0)
    assert off.min() < 8.0
