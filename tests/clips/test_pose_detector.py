"""The detector on real files: it finds a person, none in an empty room, and names what it lacks."""

from pathlib import Path

import numpy as np
import pytest

from robojackson.clips import pose_detector
from robojackson.clips.trim import trim
from robojackson.clips.video import VideoLimits, probe
from robojackson.errors import MissingDependency, UnknownName

CLIPS = Path(__file__).parents[2] / "clips"


def test_a_dancer_is_found_in_every_frame_and_stands_upright(tmp_path: Path) -> None:
    path = trim(CLIPS / "hip_shake.mp4", 0.0, 0.4, tmp_path / "part.mp4")
    info = probe(path, VideoLimits())
    calls = []
    track = pose_detector.detect(path, info, "lite", lambda *call: calls.append(call))
    assert track.detected.all()
    assert (track.landmarks[:, 0, 1] < track.landmarks[:, 27, 1]).all()
    assert calls[-1] == (info.frames, info.frames)


@pytest.mark.medium
def test_rows_that_the_decoder_pads_are_read_straight(tmp_path: Path) -> None:
    path = trim(CLIPS / "person_cam1.mp4", 0.0, 0.1, tmp_path / "part.mp4")
    info = probe(path, VideoLimits())
    assert info.width == 1080
    assert pose_detector.detect(path, info, "lite").detected.all()


def test_an_empty_room_gives_rows_of_nan(write_video) -> None:
    path = write_video(frames=4, size=(128, 96))
    track = pose_detector.detect(path, probe(path, VideoLimits()), "lite")
    assert len(track) == 4
    assert not track.detected.any()
    assert np.isnan(track.world_landmarks).all()


def test_frames_a_fraction_of_a_millisecond_apart_are_looked_at_in_order() -> None:
    room = np.zeros((96, 128, 3), np.uint8)
    with pose_detector.video_landmarker("lite") as detect_frame:
        rows = [detect_frame(room, time_s) for time_s in (0.0, 0.0003, 0.0003, 0.0006, 0.2)]
    assert np.isnan(rows).all()


def test_unknown_size_names_the_known_ones() -> None:
    with pytest.raises(UnknownName, match="full, heavy, lite"):
        pose_detector.model_path("huge")


def test_missing_bundle_names_the_command_that_builds_it(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr(pose_detector, "ASSETS", tmp_path)
    with pytest.raises(
        MissingDependency, match=r"python -m tools\.assets\.build_pose_models --size heavy"
    ):
        pose_detector.model_path("heavy")


def test_missing_graphics_library_gives_the_apt_line(write_video, monkeypatch) -> None:
    monkeypatch.setattr(pose_detector, "GRAPHICS_LIBRARIES", ("libNoSuchThing.so.9",))
    path = write_video(frames=2)
    with pytest.raises(MissingDependency, match="apt-get install --no-install-recommends libegl1"):
        pose_detector.detect(path, probe(path, VideoLimits()), "lite")
