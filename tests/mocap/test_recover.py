"""Laws of the whole stage on the recorded hip-shake: consistent, grounded, smooth, refusing."""

from dataclasses import replace

import numpy as np
import pytest

from robojackson.body.feet import foot_points
from robojackson.body.skeleton import keypoint
from robojackson.errors import NoPersonFound
from robojackson.metrics.motion_quality import floor_penetration, foot_slide, jerk
from robojackson.metrics.pose_error import rr_mpjpe
from robojackson.mocap.grounding.floor import centre_of_mass
from robojackson.mocap.landmarks.blazepose import MIRROR
from robojackson.mocap.pose.posed_body import pose_sequence
from robojackson.mocap.recover import MocapConfig, recover_motion
from robojackson.motion.landmark_track import LandmarkTrack
from robojackson.motion.smpl_sequence import AIR, PLANTED, SmplSequence

pytestmark = pytest.mark.xdist_group("recover")


@pytest.fixture(scope="module")
def motion(hip_shake: LandmarkTrack) -> SmplSequence:
    return recover_motion(hip_shake, MocapConfig())


@pytest.fixture(scope="module")
def feet(motion: SmplSequence) -> np.ndarray:
    return foot_points(pose_sequence(motion), motion.rest_joints)


@pytest.mark.medium
def test_parameters_pose_the_joints_that_are_stored(motion: SmplSequence) -> None:
    assert np.allclose(pose_sequence(motion).points, motion.keypoints_w, atol=1e-9)
    assert np.array_equal(motion.joints, motion.keypoints_w[:, :24])


@pytest.mark.medium
def test_every_frame_of_the_clip_has_a_row(motion: SmplSequence, hip_shake: LandmarkTrack) -> None:
    assert len(motion) == len(hip_shake) == len(motion.contact) == len(motion.confidence)


@pytest.mark.medium
def test_nothing_is_nan(motion: SmplSequence) -> None:
    for array in (motion.global_orient, motion.body_pose, motion.transl, motion.keypoints_w):
        assert np.isfinite(array).all()


@pytest.mark.medium
def test_the_person_stands_upright_and_faces_the_camera(motion: SmplSequence) -> None:
    trunk = motion.joints[:, keypoint("neck")] - motion.joints[:, 0]
    across = motion.joints[:, keypoint("left_hip")] - motion.joints[:, keypoint("right_hip")]
    assert (trunk[:, 2] > 0.9 * np.linalg.norm(trunk, axis=-1)).all()
    assert (across[:, 1] > 0.8 * np.linalg.norm(across, axis=-1)).all()


@pytest.mark.medium
def test_the_first_pelvis_is_over_the_origin(motion: SmplSequence) -> None:
    assert np.allclose(motion.joints[0, 0, :2], 0.0, atol=1e-9)
    assert 0.75 < motion.joints[0, 0, 2] < 1.1


@pytest.mark.medium
def test_feet_of_a_hip_shake_are_planted_all_the_time(motion: SmplSequence) -> None:
    assert (motion.contact == PLANTED).mean() > 0.97
    assert not (motion.contact == AIR).all(1).any()


@pytest.mark.medium
def test_planted_feet_do_not_slide(motion: SmplSequence, feet: np.ndarray) -> None:
    assert foot_slide(feet, motion.contact == PLANTED, motion.fps) < 0.005


@pytest.mark.medium
def test_no_foot_is_under_the_floor(feet: np.ndarray) -> None:
    assert floor_penetration(feet) < 0.002


@pytest.mark.medium
def test_the_motion_is_smoother_than_what_was_seen(
    motion: SmplSequence, hip_shake: LandmarkTrack
) -> None:
    left_wrist = hip_shake.world_landmarks[:, 15:16]
    ours = motion.joints[:, [keypoint("left_wrist")]] - motion.joints[:, :1]
    assert jerk(ours, motion.fps) < 0.3 * jerk(left_wrist, motion.fps)


@pytest.mark.medium
def test_bones_keep_their_length(motion: SmplSequence) -> None:
    shin = motion.joints[:, keypoint("left_ankle")] - motion.joints[:, keypoint("left_knee")]
    assert np.ptp(np.linalg.norm(shin, axis=-1)) < 1e-9


@pytest.mark.medium
def test_same_track_same_motion(motion: SmplSequence, hip_shake: LandmarkTrack) -> None:
    assert np.array_equal(recover_motion(hip_shake, MocapConfig()).body_pose, motion.body_pose)


def test_frames_without_a_person_are_marked_and_noted(hip_shake: LandmarkTrack) -> None:
    holes = [np.array(a) for a in (hip_shake.landmarks, hip_shake.world_landmarks)]
    for array in holes:
        array[40:44] = np.nan
    track = replace(hip_shake, landmarks=holes[0], world_landmarks=holes[1])
    found = recover_motion(track, MocapConfig())
    assert np.flatnonzero(~found.valid).tolist() == [40, 41, 42, 43]
    assert (found.confidence[40:44] == 0.0).all()
    assert "no person in 4 of 120 frames" in found.notes[0]


def test_a_clip_without_a_person_is_refused(hip_shake: LandmarkTrack) -> None:
    no_person = replace(hip_shake, landmarks=np.full_like(hip_shake.landmarks, np.nan))
    with pytest.raises(NoPersonFound, match="120 of 120"):
        recover_motion(no_person, MocapConfig())


def test_two_frames_are_enough(hip_shake: LandmarkTrack) -> None:
    short = replace(
        hip_shake,
        landmarks=hip_shake.landmarks[:2],
        world_landmarks=hip_shake.world_landmarks[:2],
        visibility=hip_shake.visibility[:2],
    )
    assert len(recover_motion(short, MocapConfig())) == 2


@pytest.mark.medium
def test_camera_in_the_result_sees_the_person_where_the_video_shows_him(
    motion: SmplSequence, hip_shake: LandmarkTrack
) -> None:
    turn, place = (np.array(motion.camera[key]) for key in ("rotation_w", "position_w"))
    seen = (motion.joints[:, keypoint("neck")] - place) @ turn
    focal = float(motion.camera["focal_px"])
    across = seen[:, 0] / seen[:, 2] * focal + hip_shake.width / 2.0
    shoulders = hip_shake.landmarks[:, [11, 12], 0].mean(1) * hip_shake.width
    assert np.abs(across - shoulders).max() < 0.03 * hip_shake.width


@pytest.mark.medium
@pytest.mark.parametrize("method", ["adaptive", "naive"])
def test_both_solves_give_a_grounded_motion(hip_shake: LandmarkTrack, method: str) -> None:
    found = recover_motion(hip_shake, MocapConfig(method=method))
    points = foot_points(pose_sequence(found), found.rest_joints)
    assert floor_penetration(points) < 0.002


def thrown(hip_shake: LandmarkTrack, height: np.ndarray) -> LandmarkTrack:
    """Return the first recorded frame moved up by some heights, metres."""
    still = np.repeat(hip_shake.landmarks[:1], len(height), axis=0)
    body_px = np.ptp(still[0, :, 1])
    still[..., 1] -= (height * body_px / 1.65)[:, None]
    return replace(
        hip_shake,
        landmarks=still,
        world_landmarks=np.repeat(hip_shake.world_landmarks[:1], len(height), axis=0),
        visibility=np.repeat(hip_shake.visibility[:1], len(height), axis=0),
    )


def jump(height_m: float, count: int, fps: float) -> np.ndarray:
    """Return the heights of a jump that begins after 1.5 s, metres."""
    speed = np.sqrt(2.0 * 9.81 * height_m)
    time = np.arange(count) / fps - 1.5
    height: np.ndarray = np.maximum(speed * time - 4.905 * time**2, 0.0) * (time > 0.0)
    return height


@pytest.mark.medium
@pytest.mark.parametrize("height_m", [0.1, 0.25, 0.45])
def test_a_jump_is_as_high_as_it_was(hip_shake: LandmarkTrack, height_m: float) -> None:
    """The recorded person thrown up: the rise within a fifth or 3 cm, no foot held meanwhile."""
    height = jump(height_m, len(hip_shake), hip_shake.fps)
    found = recover_motion(thrown(hip_shake, height), MocapConfig())
    height_of_centre = centre_of_mass(found.keypoints_w)[:, 2]
    rise = height_of_centre - height_of_centre[0]
    top = int(height.argmax())
    assert rise[top] == pytest.approx(height_m, rel=0.2, abs=0.03)
    assert (found.contact[top - 1 : top + 2] == AIR).all()
    assert (found.contact[:30] == PLANTED).all()
    assert abs(rise[-1]) < 0.02


@pytest.mark.medium
@pytest.mark.parametrize(
    ("height_m", "shown"),
    [
        (0.3, slice(54)),
        (0.3, slice(57)),
        (0.15, slice(53)),
        (0.3, slice(53, None)),
        (0.3, slice(51, None)),
        (0.15, slice(49, None)),
    ],
)
def test_a_jump_is_high_where_the_clip_is_cut_in_the_air(
    hip_shake: LandmarkTrack, height_m: float, shown: slice
) -> None:
    """A jump between the frames 45 and 60, its take-off or its landing not shown: the rise within
    three tenths, no foot held in the last frame in the air."""
    height = jump(height_m, len(hip_shake), hip_shake.fps)[shown]
    found = recover_motion(thrown(hip_shake, height), MocapConfig())
    cut, standing = (0, -1) if shown.start else (-1, 0)
    rise = centre_of_mass(found.keypoints_w)[:, 2]
    rise = rise - rise[standing]
    top = int(height.argmax())
    assert rise[top] == pytest.approx(height[top], rel=0.3)
    assert rise[cut] == pytest.approx(height[cut], abs=0.09)
    assert (found.contact[cut] == AIR).all()
    assert (found.contact[standing] == PLANTED).all()


@pytest.mark.medium
def test_a_weak_stretch_is_left_out_on_request(
    hip_shake: LandmarkTrack, motion: SmplSequence
) -> None:
    spoilt = slice(50, 58)
    rng = np.random.default_rng(0)
    landmarks = np.array(hip_shake.landmarks)
    landmarks[spoilt, :, :2] += rng.uniform(-0.2, 0.2, size=landmarks[spoilt, :, :2].shape)
    world = np.array(hip_shake.world_landmarks)
    world[spoilt] += rng.uniform(-0.4, 0.4, size=world[spoilt].shape)
    track = replace(hip_shake, landmarks=landmarks, world_landmarks=world)
    off = []
    for leave_out_weak in (False, True):
        found = recover_motion(track, MocapConfig(leave_out_weak=leave_out_weak))
        apart = (found.joints - found.joints[:, :1]) - (motion.joints - motion.joints[:, :1])
        off.append(np.linalg.norm(apart, axis=-1)[spoilt].mean())
    assert any("left out" in note for note in found.notes)
    assert not found.valid[spoilt].any()
    assert off[1] < 0.5 * off[0]


@pytest.mark.medium
def test_a_dancer_in_a_mirror_gives_the_motion_in_a_mirror(
    hip_shake: LandmarkTrack, motion: SmplSequence
) -> None:
    """The landmarks are mirrored exactly, so that only our own stages could break the symmetry."""
    landmarks = hip_shake.landmarks[:, MIRROR] * [-1.0, 1.0, 1.0] + [1.0, 0.0, 0.0]
    other = replace(
        hip_shake,
        landmarks=landmarks,
        world_landmarks=hip_shake.world_landmarks[:, MIRROR] * [-1.0, 1.0, 1.0],
        visibility=hip_shake.visibility[:, MIRROR],
    )
    found = recover_motion(other, MocapConfig())
    names = ("hip", "knee", "ankle", "shoulder", "elbow", "wrist")
    left, right = ([keypoint(f"{side}_{name}") for name in names] for side in ("left", "right"))
    mirrored = found.joints[:, [*right, *left]] * [1.0, -1.0, 1.0]
    assert rr_mpjpe(mirrored, motion.joints[:, [*left, *right]], (0, 6)) < 0.002
