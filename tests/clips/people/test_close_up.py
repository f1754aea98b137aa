"""Laws of the close look: a person far away is found."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from robojackson.clips.people.close_up import CloseUpConfig, _all_over, look_closely
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
