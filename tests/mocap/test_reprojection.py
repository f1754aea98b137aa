"""Laws of the overlay: a body on its landmarks is off by nothing, one beside them by as much."""

from dataclasses import replace

import numpy as np
import pytest

from robojackson.body.skeleton import REST_JOINTS, keypoint
from robojackson.errors import NoPersonFound
from robojackson.mocap.landmarks.blazepose import BODY, LANDMARK_NAMES, MIRROR
from robojackson.mocap.reprojection import (
    leaving_out_weak,
    reprojection_error,
    reprojection_record,
    weak_frames,
    without_weak_frames,
)
from robojackson.motion.landmark_track import LandmarkTrack
from robojackson.motion.smpl_sequence import SmplSequence

FRAMES, FOCAL, WIDTH, HEIGHT = 12, 900.0, 640, 480
CAMERA = np.array([[0.0, 0.0, -1.0], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
PLACE = np.array([4.0, 0.0, 1.0])


@pytest.fixture
def clip() -> tuple[SmplSequence, LandmarkTrack]:
    points = np.repeat((REST_JOINTS[:, [2, 0, 1]] + [0.0, 0.0, 0.9])[None], FRAMES, axis=0)
    sequence = SmplSequence(
        fps=30.0,
        global_orient=np.zeros((FRAMES, 3)),
        body_pose=np.zeros((FRAMES, 69)),
        transl=np.zeros((FRAMES, 3)),
        joints=points[:, :24],
        keypoints_w=points,
        confidence=np.ones((FRAMES, 29)),
        contact=np.zeros((FRAMES, 4), np.int8),
        valid=np.ones(FRAMES, bool),
        betas=np.zeros(10),
        rest_joints=REST_JOINTS,
        camera={
            "focal_px": FOCAL, "width": WIDTH, "height": HEIGHT,
            "rotation_w": CAMERA.tolist(), "position_w": PLACE.tolist(),
        },
    )  # fmt: skip
    seen = (points - PLACE) @ CAMERA
    pixels = seen[..., :2] / seen[..., 2:] * FOCAL + [WIDTH / 2, HEIGHT / 2]
    landmarks = np.full((FRAMES, 33, 3), 0.5)
    names = [LANDMARK_NAMES[index] for index in BODY]
    landmarks[:, BODY, :2] = pixels[:, [keypoint(name) for name in names]] / [WIDTH, HEIGHT]
    track = LandmarkTrack(
        30.0, WIDTH, HEIGHT, landmarks, np.zeros((FRAMES, 33, 3)), np.ones((FRAMES, 33))
    )
    return sequence, track


def test_a_body_on_its_landmarks_has_no_error(clip: tuple[SmplSequence, LandmarkTrack]) -> None:
    error = reprojection_error(*clip)
    assert error is not None
    assert np.allclose(error, 0.0, atol=1e-9)


def test_exchanged_sides_are_no_error(clip: tuple[SmplSequence, LandmarkTrack]) -> None:
    error = reprojection_error(clip[0], replace(clip[1], landmarks=clip[1].landmarks[:, MIRROR]))
    assert error is not None
    assert np.allclose(error, 0.0, atol=1e-9)


def test_a_body_beside_its_landmarks_is_off_by_as_much(
    clip: tuple[SmplSequence, LandmarkTrack],
) -> None:
    sequence, track = clip
    moved = np.array(track.landmarks)
    moved[4:7, :, 0] += 0.3 * FOCAL / 4.0 / WIDTH
    track = replace(track, landmarks=moved)
    error = reprojection_error(sequence, track)
    assert error is not None
    assert np.allclose(error[4:7], 0.3, atol=0.02)
    assert np.flatnonzero(weak_frames(sequence, track)).tolist() == [4, 5, 6]
    found = reprojection_record(sequence, track)["reprojection"]
    assert isinstance(found, dict)
    assert found["weak_s"] == [[pytest.approx(4 / 30), pytest.approx(7 / 30)]]
    later = reprojection_record(sequence, track, 2.0)["reprojection"]
    assert isinstance(later, dict)
    assert later["weak_s"] == [[pytest.approx(2 + 4 / 30), pytest.approx(2 + 7 / 30)]]


def test_weak_frames_and_their_neighbours_are_left_out(
    clip: tuple[SmplSequence, LandmarkTrack],
) -> None:
    weak = np.zeros(FRAMES, bool)
    weak[6] = True
    kept = without_weak_frames(replace(clip[1], fps=20.0), weak)
    assert np.flatnonzero(~kept.detected).tolist() == [4, 5, 6, 7, 8]
    assert kept.notes == ("5 frames left out: the body lay off the picture",)


def test_a_track_of_weak_frames_alone_is_left_as_it_is(
    clip: tuple[SmplSequence, LandmarkTrack],
) -> None:
    assert without_weak_frames(clip[1], np.ones(FRAMES, bool)) is clip[1]


def test_damaged_frames_are_not_taken_for_weak_ones(
    clip: tuple[SmplSequence, LandmarkTrack],
) -> None:
    notes = ("3 of 15 frames are damaged and were left out",)
    found = reprojection_record(replace(clip[0], notes=notes), clip[1])["reprojection"]
    assert isinstance(found, dict)
    assert not found["left_out"]


def test_the_first_motion_stands_where_too_little_would_be_left(
    clip: tuple[SmplSequence, LandmarkTrack],
) -> None:
    sequence, track = clip
    moved = np.array(track.landmarks)
    moved[1:, :, 0] += 0.3 * FOCAL / 4.0 / WIDTH
    calls = []

    def recover(given: LandmarkTrack) -> SmplSequence:
        calls.append(int(given.detected.sum()))
        if calls[-1] < 2:
            raise NoPersonFound("no person found")
        return sequence

    assert leaving_out_weak(recover, replace(track, landmarks=moved), True) is sequence


def test_a_track_without_weak_frames_is_left_as_it_is(
    clip: tuple[SmplSequence, LandmarkTrack],
) -> None:
    assert without_weak_frames(clip[1], np.zeros(FRAMES, bool)) is clip[1]
