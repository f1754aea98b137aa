"""What a motion is made from: the models of a quality, one progress for all, the camera's path."""

from pathlib import Path

import numpy as np
import pytest

from robojackson.clips.people.dancer import DancerConfig
from robojackson.clips.video import VideoLimits, probe, timed_frames
from robojackson.mocap.landmarks import landmark_pipeline
from robojackson.motion.landmark_track import LandmarkTrack

CLIP = Path(__file__).parents[3] / "clips" / "hip_shake.mp4"


@pytest.fixture
def followed(hip_shake: LandmarkTrack, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Return the pose models that ran, each of which finds the recorded track."""
    used: list[str] = []

    def follow(path, info, size, dancer, progress=None, watch=None) -> LandmarkTrack:
        used.append(size)
        for done in (60, 120):
            if progress:
                progress(done, 120)
        return hip_shake

    monkeypatch.setattr(landmark_pipeline, "track_dancer", follow)
    return used


def look(quality: str, progress=None) -> LandmarkTrack:
    info = probe(CLIP, VideoLimits())
    return landmark_pipeline.detect_landmarks(CLIP, info, quality, DancerConfig(), progress)


def test_best_runs_both_larger_models_and_they_vote(
    followed: list[str], hip_shake: LandmarkTrack
) -> None:
    found = look("best")
    assert followed == ["full", "heavy"]
    assert np.allclose(found.landmarks, hip_shake.landmarks)


def test_one_model_is_requested_once_and_its_track_is_kept(
    followed: list[str], hip_shake: LandmarkTrack
) -> None:
    found = look("full")
    assert followed == ["full"]
    assert np.array_equal(found.world_landmarks, hip_shake.world_landmarks)


def test_progress_of_two_models_runs_once_from_nothing_to_all(followed: list[str]) -> None:
    calls: list[tuple[int, int]] = []
    look("best", lambda done, total: calls.append((done, total)))
    assert calls == [(30, 120), (60, 120), (90, 120), (120, 120)]


def test_a_camera_that_stands_leaves_the_track_without_a_note(followed: list[str]) -> None:
    found = look("full")
    assert found.to_first is None
    assert found.notes == ()


def test_pictures_of_one_pass_give_what_a_second_pass_gives(hip_shake: LandmarkTrack) -> None:
    """One decoding at full size and one made small from the start."""
    background = landmark_pipeline.Background()
    rows = hip_shake.landmarks
    for index, ((_, image), row) in enumerate(zip(timed_frames(CLIP), rows, strict=True)):
        background.add_frame(index, image, row)
    once = background.applied_to(hip_shake)
    twice = landmark_pipeline.with_camera(CLIP, hip_shake)
    assert once.to_first is None
    assert twice.to_first is None
    assert once.brightness == pytest.approx(twice.brightness, rel=0.02)
    assert once.sharpness == pytest.approx(twice.sharpness, rel=0.1)


@pytest.mark.parametrize("size", [(1920, 1080), (480, 640), (300, 320), (100, 90)])
def test_pictures_are_made_about_as_small_as_requested(size: tuple[int, int]) -> None:
    small = landmark_pipeline.shrunk(np.zeros((*size, 3), np.uint8))
    assert min(small.shape[:2]) <= 1.2 * landmark_pipeline.SHORT_SIDE
    assert small.shape[0] / small.shape[1] == pytest.approx(size[0] / size[1], rel=0.02)
