"""What `mocap` counts: the frames of the motion in which the person was seen, by any camera."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from robojackson.cli import mocap_card, stages
from robojackson.clips.video import VideoInfo
from robojackson.mocap.recover import MocapConfig, recover_motion
from robojackson.motion.landmark_track import ARRAYS, LandmarkTrack

ROOT = Path(__file__).parents[2]
CLIP = ROOT / "clips" / "hip_shake.mp4"


@pytest.fixture(scope="module")
def hip_shake() -> LandmarkTrack:
    """Return the 120 frames that MediaPipe found in the clip."""
    with np.load(ROOT / "tests" / "golden" / "hip_shake_track.npz") as data:
        size = float(data["fps"]), int(data["width"]), int(data["height"])
        points = (data[name].astype(float) for name in ARRAYS)
        return LandmarkTrack(*size, *points)


def figures(
    track: LandmarkTrack, valid: np.ndarray | None, out: Path, second: Path | None = None
) -> dict:
    """Return the figures of `mocap` for a track, with the frames that its motion was seen in."""
    sequence = recover_motion(track, MocapConfig())
    if valid is not None:
        sequence = replace(sequence, valid=valid)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(stages, "_track_of", lambda *_: track)
        patch.setattr(stages, "_motion_of", lambda *_: sequence)
        return stages.mocap(CLIP, out, "base", {}, second=second)


def test_a_motion_with_a_pause_is_not_whole(hip_shake: LandmarkTrack, tmp_path: Path) -> None:
    times = np.arange(120) / 30.0 + np.where(np.arange(120) < 60, 0.0, 2.5)
    answer = figures(replace(hip_shake, time_s=times), None, tmp_path)
    assert (answer["frames"], answer["detected"]) == (195, 120)
    assert mocap_card.mocap_verdict(answer)["kind"] == "poor"


@pytest.mark.parametrize(("second", "kind"), [(None, "poor"), (CLIP, "whole")])
def test_who_is_hidden_from_the_first_camera_is_seen_by_the_second(
    hip_shake: LandmarkTrack, tmp_path: Path, second: Path | None, kind: str
) -> None:
    points = hip_shake.landmarks.copy()
    points[30:90] = np.nan
    track, valid = replace(hip_shake, landmarks=points), np.ones(120, bool)
    answer = figures(track, valid if second else None, tmp_path, second)
    assert mocap_card.mocap_verdict(answer)["kind"] == kind
    assert ("person_missing" in {each["kind"] for each in answer["advice"]}) == (second is None)


def test_the_landmarks_of_a_range_know_where_it_begins(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Read(Exception):
        """Ends the stage where the video was read."""

    def read(_work: object, _path: Path, info: VideoInfo, *_: object, **__: object) -> None:
        raise Read(info.begin_s)

    monkeypatch.setattr(stages, "in_video_process", read)
    with pytest.raises(Read, match=r"1\.2"):
        stages.mocap(CLIP, tmp_path, "base", {}, start_s=1.2)
