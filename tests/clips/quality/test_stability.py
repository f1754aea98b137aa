"""Laws of Algorithm 1, with hand-worked numbers."""

import numpy as np
import pytest

from robojackson.clips.quality.stability import StabilityConfig, jitter, missing_joints, stability
from robojackson.motion.landmark_track import LandmarkTrack


def track_of(xy: np.ndarray, visibility: np.ndarray) -> LandmarkTrack:
    landmarks = np.concatenate([xy, np.zeros((*xy.shape[:2], 1))], -1)
    return LandmarkTrack(30.0, 640, 480, landmarks, landmarks, visibility)


def still_track(frames: int, visibility: float = 0.9) -> LandmarkTrack:
    return track_of(np.full((frames, 33, 2), 0.5), np.full((frames, 33), visibility))


def test_hand_worked_clip() -> None:
    xy = np.zeros((3, 33, 2))
    xy[1] = [0.03, 0.04]
    xy[2, 0] = [0.03, 0.04]
    visibility = np.full((3, 33), 0.9)
    visibility[0, :4] = 0.2
    result = stability(track_of(xy, visibility), StabilityConfig())
    assert result.missing_joints == 4
    assert result.jitter == pytest.approx(0.05 + 0.05 * 32 / 33)
    assert result.stability_score == pytest.approx(4 + 0.05 + 0.05 * 32 / 33)


def test_a_still_visible_clip_scores_zero() -> None:
    assert stability(still_track(10), StabilityConfig()).stability_score == 0.0


def test_no_person_in_the_clip_is_an_answer() -> None:
    empty = track_of(np.full((7, 33, 2), np.nan), np.full((7, 33), np.nan))
    result = stability(empty, StabilityConfig())
    assert (result.detected, result.missing_joints, result.jitter) == (0, 33 * 7, 0.0)


def test_steps_beside_a_gap_do_not_count() -> None:
    xy = np.zeros((4, 33, 2))
    xy[2] = np.nan
    xy[3] = 1.0
    assert jitter(xy) == 0.0


def test_visibility_at_the_threshold_is_not_missing() -> None:
    assert missing_joints(np.full((2, 33), 0.5), 0.5) == 0


def test_jitter_does_not_see_where_in_the_image_the_person_is() -> None:
    xy = np.random.default_rng(0).uniform(size=(12, 33, 2))
    assert jitter(xy + [0.3, -0.2]) == pytest.approx(jitter(xy))


def test_jitter_grows_with_the_motion() -> None:
    xy = np.random.default_rng(1).uniform(size=(12, 33, 2))
    assert jitter(2.0 * xy) == pytest.approx(2.0 * jitter(xy))


def test_per_frame_figures_do_not_favour_short_clips() -> None:
    short, long = still_track(5, 0.1), still_track(50, 0.1)
    scores = [stability(track, StabilityConfig()) for track in (short, long)]
    assert scores[0].missing_joints_per_frame == scores[1].missing_joints_per_frame == 33
    assert scores[0].missing_joints < scores[1].missing_joints
