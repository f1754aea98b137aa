"""Laws of the repair of a track: gaps are bridged, swapped sides put back, no one is an error."""

from dataclasses import replace

import numpy as np
import pytest

from robojackson.errors import NoPersonFound, TrackTooShort, UnknownName
from robojackson.mocap.landmarks.blazepose import (
    EARS,
    FACE,
    HIPS,
    LANDMARK_NAMES,
    MIRROR,
    SHOULDERS,
    Landmarks,
    fill_gaps,
    landmark,
    repair,
    swapped_frames,
    track_landmarks,
)
from robojackson.motion.landmark_track import LandmarkTrack


def without(track: LandmarkTrack, frames: list[int]) -> LandmarkTrack:
    """Return the track without a person in some frames."""
    arrays = [np.array(a) for a in (track.landmarks, track.world_landmarks, track.visibility)]
    for array in arrays:
        array[frames] = np.nan
    landmarks, world, visibility = arrays
    return replace(track, landmarks=landmarks, world_landmarks=world, visibility=visibility)


def swapped(track: LandmarkTrack, frames: list[int]) -> LandmarkTrack:
    """Return the track with left and right exchanged in some frames."""
    arrays = [np.array(a) for a in (track.landmarks, track.world_landmarks, track.visibility)]
    for array in arrays:
        array[frames] = array[frames][:, MIRROR]
    landmarks, world, visibility = arrays
    return replace(track, landmarks=landmarks, world_landmarks=world, visibility=visibility)


def test_gap_inside_is_bridged_linearly() -> None:
    values = np.array([[0.0], [np.nan], [np.nan], [3.0]])
    found = np.array([True, False, False, True])
    assert np.allclose(fill_gaps(values, found)[:, 0], [0, 1, 2, 3])


def test_gap_at_an_end_holds_the_nearest_frame() -> None:
    values = np.array([[np.nan], [5.0], [6.0], [np.nan]])
    assert np.allclose(fill_gaps(values, ~np.isnan(values[:, 0]))[:, 0], [5, 5, 6, 6])


def test_mirror_pairs_left_with_right() -> None:
    assert (MIRROR[MIRROR] == np.arange(33)).all()
    assert LANDMARK_NAMES[MIRROR[landmark("mouth_left")]] == "mouth_right"


def test_a_clean_track_is_left_alone(hip_shake: LandmarkTrack) -> None:
    repaired = repair(hip_shake)
    assert repaired.swapped == 0
    others = [i for i in range(33) if i not in HIPS]
    assert np.array_equal(repaired.local[:, others], hip_shake.world_landmarks[:, others])


@pytest.mark.parametrize("frames", [[50], list(range(30, 60)), [10, 11, 12, 90]])
def test_exchanged_sides_are_put_back(hip_shake: LandmarkTrack, frames: list[int]) -> None:
    repaired = repair(swapped(hip_shake, frames))
    assert repaired.swapped == len(frames)
    assert np.allclose(repaired.image, repair(hip_shake).image)


@pytest.mark.parametrize("frames", [[20], list(range(8, 13))])
def test_exchanged_sides_are_put_back_at_ten_frames_a_second(
    hip_shake: LandmarkTrack, frames: list[int]
) -> None:
    arrays = (hip_shake.landmarks, hip_shake.world_landmarks, hip_shake.visibility)
    landmarks, world, visibility = (array[::3] for array in arrays)
    slow = replace(
        hip_shake, fps=10.0, landmarks=landmarks, world_landmarks=world, visibility=visibility
    )
    repaired = repair(swapped(slow, frames))
    assert repaired.swapped == len(frames)
    assert np.allclose(repaired.image, repair(slow).image)


def test_undetected_frames_are_invalid_and_invisible(hip_shake: LandmarkTrack) -> None:
    repaired = repair(without(hip_shake, [20, 21]))
    assert np.flatnonzero(~repaired.valid).tolist() == [20, 21]
    assert (repaired.visibility[20:22] == 0.0).all()
    assert not np.isnan(repaired.local).any()


def test_no_one_in_the_clip_names_the_frames(hip_shake: LandmarkTrack) -> None:
    with pytest.raises(NoPersonFound, match="no person found in 120 of 120 frames"):
        repair(without(hip_shake, list(range(120))))


def test_one_frame_is_too_short(hip_shake: LandmarkTrack) -> None:
    one = replace(
        hip_shake,
        landmarks=hip_shake.landmarks[:1],
        world_landmarks=hip_shake.world_landmarks[:1],
        visibility=hip_shake.visibility[:1],
    )
    with pytest.raises(TrackTooShort, match="at least 2 frames"):
        repair(one)


def test_unknown_landmark_names_the_known_ones() -> None:
    with pytest.raises(UnknownName, match="left_shoulder"):
        landmark("left_sholder")


def test_hip_joints_lie_on_the_trunk_above_the_detectors_hips(hip_shake: LandmarkTrack) -> None:
    before, after = track_landmarks(hip_shake), repair(hip_shake)
    for was, now in ((before.image, after.image), (before.local, after.local)):
        trunk = was[:, SHOULDERS].mean(1) - was[:, HIPS].mean(1)
        step = now[:, HIPS] - was[:, HIPS]
        assert np.allclose(step, 0.06 * trunk[:, None], atol=1e-9)


def test_landmarks_of_a_moved_camera_are_laid_onto_the_first_frame(
    hip_shake: LandmarkTrack,
) -> None:
    to_first = np.tile(np.eye(3), (len(hip_shake), 1, 1))
    to_first[:, 0, 2] = np.arange(len(hip_shake))
    moved = track_landmarks(replace(hip_shake, to_first=to_first)).image
    shift = moved - track_landmarks(hip_shake).image
    assert np.allclose(shift[..., 0], np.arange(len(hip_shake))[:, None])
    assert np.allclose(shift[..., 1], 0.0)


def test_twice_the_frame_rate_finds_the_same_exchanges(hip_shake: LandmarkTrack) -> None:
    """A person who stands still and is nearly symmetric in the picture: how long the sides have to
    be exchanged until that is believed is a time, not a count of frames."""

    def left_exchanged(share: float, frames: int, fps: float) -> bool:
        seen = track_landmarks(hip_shake)
        image, local = (
            np.repeat(each[:1] + share * (each[:1, MIRROR] - each[:1]), 3 * frames, axis=0)
            for each in (seen.image, seen.local)
        )
        for each in (image, local):
            each[frames : 2 * frames] = each[frames : 2 * frames, MIRROR]
        still = np.ones(3 * frames, bool)
        lm = Landmarks(image, local, np.ones((3 * frames, 33)), still)
        return not swapped_frames(lm, fps).any()

    shares = np.linspace(0.2, 0.5, 31)
    usual = [left_exchanged(share, 30, 30.0) for share in shares]
    assert {True, False} == set(usual)
    assert [left_exchanged(share, 60, 60.0) for share in shares] == usual
    assert [left_exchanged(share, 120, 120.0) for share in shares] == usual


def test_a_turn_at_eight_frames_a_second_is_not_taken_for_an_exchange(
    hip_shake: LandmarkTrack,
) -> None:
    mirrored = hip_shake.landmarks.copy()
    mirrored[60:] = mirrored[60:, MIRROR]
    slow = replace(hip_shake, fps=8.0, landmarks=mirrored)
    assert repair(slow).swapped == 0
    assert repair(replace(slow, fps=30.0)).swapped > 0


def test_a_face_towards_the_camera_outweighs_a_majority_from_behind(
    hip_shake: LandmarkTrack,
) -> None:
    """Sides jump once in the clip. The part whose face was detected from behind is the wrong one,
    even if it is the longer one."""
    frames = list(range(40, len(hip_shake)))
    track = swapped(hip_shake, frames)
    world = np.array(track.world_landmarks)
    world[frames, : landmark("left_shoulder"), 2] *= -1.0
    lm = track_landmarks(replace(track, world_landmarks=world))
    assert np.flatnonzero(swapped_frames(lm, track.fps)).tolist() == frames


def test_a_face_taken_for_one_seen_from_the_other_side_is_turned(hip_shake: LandmarkTrack) -> None:
    """Front and back of a person look alike in outline: the detector has both the sides and the
    depth of the face reversed. The repair gives both back, and moves nothing else."""
    frames = [20, 21, 40]
    track = swapped(hip_shake, frames)
    world = np.array(track.world_landmarks)
    ears = world[frames][:, EARS, 2].mean(1, keepdims=True)
    world[np.ix_(frames, FACE, [2])] = (2.0 * ears - world[frames][:, FACE, 2])[..., None]
    found = repair(replace(track, world_landmarks=world))
    assert found.swapped == len(frames)
    np.testing.assert_allclose(found.local, repair(hip_shake).local, atol=1e-9)
    np.testing.assert_allclose(found.image, repair(hip_shake).image, atol=1e-9)
