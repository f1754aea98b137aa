"""Laws of the close look: windows cover, hold and follow; a person far away is found."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from robojackson.clips.people.close_up import (
    STAYS,
    CloseUpConfig,
    _all_over,
    in_picture,
    look_closely,
    tiles,
    window,
    windows,
)
from robojackson.clips.people.dancer import DancerConfig, track_dancer
from robojackson.clips.pose_detector import detect
from robojackson.clips.video import VideoInfo, VideoLimits, probe, read_frames
from tests.fixtures.made_people import SIZE, row_of

ROOT = Path(__file__).parents[3]
CLIP = ROOT / "clips" / "hip_shake.mp4"
TRACK = ROOT / "tests" / "golden" / "hip_shake_track.npz"
WIDTH, HEIGHT = 1280, 720
SMALL, CORNER = (160, 120), (900, 500)
FRAMES = 4


@pytest.mark.parametrize("shape", [(2, 2), (2, 2048), (1080, 4)])
def test_a_strip_of_pixels_is_not_searched(shape: tuple[int, int]) -> None:
    """No landmarker is called: the one given is none."""
    assert _all_over(None, np.zeros((*shape, 3), np.uint8), 0.5) is None


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


@pytest.fixture(scope="module")
def far_away(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, VideoInfo]:
    """A dancer 90 pixels tall in a picture of 1280 x 720."""
    import av

    path = tmp_path_factory.mktemp("far") / "far.mp4"
    with av.open(str(path), "w") as container:
        stream = container.add_stream("libx264", rate=30, options={"crf": "12"})
        stream.width, stream.height, stream.pix_fmt = WIDTH, HEIGHT, "yuv420p"
        for image, _ in zip(read_frames(CLIP), range(FRAMES), strict=False):
            picture = np.full((HEIGHT, WIDTH, 3), image[0, 0], np.uint8)
            small = cv2.resize(image, SMALL, interpolation=cv2.INTER_AREA)
            x, y = CORNER
            picture[y : y + SMALL[1], x : x + SMALL[0]] = small
            container.mux(stream.encode(av.VideoFrame.from_ndarray(picture)))
        container.mux(stream.encode(None))
    return path, probe(path, VideoLimits())


@pytest.mark.medium
def test_a_person_far_away_is_found_where_he_is(far_away: tuple[Path, VideoInfo]) -> None:
    path, info = far_away
    assert not detect(path, info, "lite").detected.any()
    track = track_dancer(path, info, "lite", DancerConfig())
    assert track.detected.all()
    assert any("looked at closely" in note for note in track.notes)
    pixels = track.landmarks[..., :2] * [WIDTH, HEIGHT]
    with np.load(TRACK) as near:
        expected = near["landmarks"][:FRAMES, :, :2] * SMALL + CORNER
    assert np.linalg.norm(pixels - expected, axis=-1).mean() < 3.0


def test_a_person_in_nearly_all_frames_is_not_looked_at_closely() -> None:
    rows = np.array([row_of(100)] * 10)
    info = VideoInfo(Path("there-is-none.mp4"), *SIZE, 30.0, 10, 1 / 3, 0)
    assert look_closely(info.path, info, "lite", rows, CloseUpConfig()) is None
