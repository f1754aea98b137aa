"""Laws of the vote: what is in one is in the mean, sides agree, one who is blind does not count."""

from dataclasses import replace

import numpy as np
import pytest

from robojackson.mocap.landmarks.blazepose import BODY, MIRROR
from robojackson.mocap.landmarks.model_fusion import fuse_tracks
from robojackson.motion.landmark_track import LandmarkTrack


def test_two_equal_tracks_vote_for_themselves(hip_shake: LandmarkTrack) -> None:
    found = fuse_tracks([hip_shake, hip_shake])
    assert np.allclose(found.landmarks, hip_shake.landmarks)
    assert np.allclose(found.world_landmarks, hip_shake.world_landmarks, atol=1e-9)


def test_opposite_errors_cancel(hip_shake: LandmarkTrack) -> None:
    noise = 0.02 * np.random.default_rng(0).normal(size=hip_shake.landmarks.shape)
    pair = [replace(hip_shake, landmarks=hip_shake.landmarks + sign * noise) for sign in (1, -1)]
    assert np.allclose(fuse_tracks(pair).landmarks, hip_shake.landmarks)


def test_a_frame_that_one_model_misses_is_the_others(hip_shake: LandmarkTrack) -> None:
    blind = [np.array(a) for a in (hip_shake.landmarks, hip_shake.world_landmarks)]
    for array in blind:
        array[50] = np.nan
    other = replace(hip_shake, landmarks=blind[0], world_landmarks=blind[1])
    found = fuse_tracks([other, hip_shake])
    assert found.detected.all()
    assert np.allclose(found.landmarks[50], hip_shake.landmarks[50])


def test_a_frame_that_both_miss_stays_empty(hip_shake: LandmarkTrack) -> None:
    image = np.array(hip_shake.landmarks)
    image[50] = np.nan
    blind = replace(hip_shake, landmarks=image)
    assert np.flatnonzero(~fuse_tracks([blind, blind]).detected).tolist() == [50]


def test_sides_that_one_model_exchanged_are_put_back_before_the_vote(
    hip_shake: LandmarkTrack,
) -> None:
    image, world = np.array(hip_shake.landmarks), np.array(hip_shake.world_landmarks)
    image[60:63], world[60:63] = image[60:63][:, MIRROR], world[60:63][:, MIRROR]
    other = replace(hip_shake, landmarks=image, world_landmarks=world)
    assert np.allclose(fuse_tracks([hip_shake, other]).landmarks, hip_shake.landmarks)


def test_a_model_that_sees_everybody_lean_is_turned_to_the_first(
    hip_shake: LandmarkTrack,
) -> None:
    angle = np.radians(8.0)
    lean = np.array(
        [[1, 0, 0], [0, np.cos(angle), -np.sin(angle)], [0, np.sin(angle), np.cos(angle)]]
    )
    other = replace(hip_shake, world_landmarks=hip_shake.world_landmarks @ lean.T)
    found = fuse_tracks([hip_shake, other]).world_landmarks
    assert np.allclose(found[:, BODY], hip_shake.world_landmarks[:, BODY], atol=3e-3)


def test_tracks_of_different_clips_are_refused(hip_shake: LandmarkTrack) -> None:
    with pytest.raises(ValueError, match="same clip"):
        fuse_tracks([hip_shake, replace(hip_shake, fps=25.0)])


def test_in_a_slow_clip_no_sides_are_exchanged(hip_shake: LandmarkTrack) -> None:
    """Between two frames an eighth of a second apart somebody may have turned round."""
    image, world = np.array(hip_shake.landmarks), np.array(hip_shake.world_landmarks)
    image[60:], world[60:] = image[60:][:, MIRROR], world[60:][:, MIRROR]
    turned = replace(hip_shake, landmarks=image, world_landmarks=world, fps=8.0)
    assert np.allclose(fuse_tracks([turned, turned]).landmarks, image)
