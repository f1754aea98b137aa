"""Laws of two cameras: they are synchronised and found by the dancer, and see depth together."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from robojackson.clips.sound import RATE, Sound
from robojackson.errors import ViewsDisagree
from robojackson.mocap.landmarks.blazepose import BODY, HIPS
from robojackson.mocap.recover import MocapConfig, recover_motion, view_track
from robojackson.mocap.views.relative_camera import calibrate, sampson, triangulate
from robojackson.mocap.views.timing import FPS, find_offsets, rates, sound_offset
from robojackson.mocap.views.two_cameras import recover_together
from robojackson.motion.landmark_track import LandmarkTrack

pytestmark = pytest.mark.xdist_group("two_cameras")

TURN = Rotation.from_euler("y", 70.0, degrees=True).as_matrix()
FLAT = 0.4
"""What both made cameras leave of depth."""


@pytest.fixture(scope="module")
def dancer(hip_shake: LandmarkTrack) -> np.ndarray:
    """Return a body that swings its limbs more than the recorded one, camera frame, metres."""
    points = view_track(hip_shake, MocapConfig()).points
    time = np.arange(len(points)) / hip_shake.fps
    away = points - points[:, HIPS].mean(1, keepdims=True)
    lean = Rotation.from_euler(
        "yx", np.stack([0.5 * np.sin(3.1 * time), 0.2 * np.sin(5 * time)], 1)
    )
    stretch = 1.0 + 0.2 * np.sin(4.3 * time + 1.0)[:, None, None]
    turned = np.einsum("tij,tnj->tni", lean.as_matrix(), away * stretch)
    result: np.ndarray = turned + points[:, HIPS].mean(1, keepdims=True)
    return result


def second_frame(points: np.ndarray) -> np.ndarray:
    """Return the points before a camera that stands 70 degrees aside."""
    middle = points.mean((0, 1))
    result: np.ndarray = (points - middle) @ TURN.T + middle
    return result


def filmed(points: np.ndarray, like: LandmarkTrack) -> LandmarkTrack:
    """Return the landmarks of a detector that flattens depth."""
    focal = view_track(like, MocapConfig()).pinhole.focal_px
    image = points[..., :2] / points[..., 2:] * focal / [like.width, like.height] + 0.5
    local = (points - points[:, HIPS].mean(1, keepdims=True)) * [1.0, 1.0, FLAT]
    count = len(points)
    return replace(
        like,
        landmarks=np.concatenate([image, np.zeros((count, 33, 1))], -1),
        world_landmarks=local,
        visibility=np.ones((count, 33)),
        time_s=None,
    )


def hidden(track: LandmarkTrack, *parts: slice) -> LandmarkTrack:
    """Return a track that has no person in some frames."""
    found = {n: np.array(getattr(track, n)) for n in ("landmarks", "world_landmarks", "visibility")}
    for array in found.values():
        for part in parts:
            array[part] = np.nan
    return replace(track, **found)


def off(joints: np.ndarray, truth: np.ndarray) -> float:
    from robojackson.metrics.pose_error import pa_mpjpe

    return pa_mpjpe(joints, truth)


@pytest.mark.medium
def test_the_offset_of_the_same_motion_is_found_from_another_side(
    dancer: np.ndarray, hip_shake: LandmarkTrack
) -> None:
    times = np.arange(len(dancer)) / hip_shake.fps
    one, two = rates(dancer, times), rates(second_frame(dancer)[20:], times[:-20])
    assert find_offsets(one, two)[0].seconds == pytest.approx(20 / hip_shake.fps, abs=0.5 / FPS)


def test_the_offset_of_the_same_sound_is_found() -> None:
    rng = np.random.default_rng(0)
    noise = (
        rng.normal(size=(6 * RATE, 2)) * np.repeat(rng.uniform(0.0, 0.2, 60), RATE // 10)[:, None]
    )
    late = round(1.3 * RATE)
    found = sound_offset(Sound(noise), Sound(0.3 * noise[late:]))
    assert found == pytest.approx(1.3, abs=0.01)


def test_sounds_of_different_places_give_no_offset() -> None:
    rng = np.random.default_rng(1)
    one, two = (Sound(0.1 * rng.normal(size=(3 * RATE, 2))) for _ in range(2))
    assert sound_offset(one, two) is None


def test_points_are_where_their_rays_meet() -> None:
    rng = np.random.default_rng(2)
    points = rng.normal(size=(40, 12, 3)) * 0.5 + [0.0, 0.0, 4.0]
    other = second_frame(points)
    camera = calibrate(points, other, np.ones((40, 12)), np.arange(40), 30.0)
    rays = tuple(
        p[..., :2] / p[..., 2:] / f for p, f in zip((points, other), camera.focal, strict=True)
    )
    assert np.abs(sampson(camera, rays[0], rays[1])).max() < 1e-3
    assert np.linalg.norm(triangulate(camera, (rays[0], rays[1])) - points, axis=-1).max() < 0.05


def test_a_clip_that_is_late_is_found_although_the_person_is_lost_between_its_frames() -> None:
    """A speed across a gap is none of the person's."""
    rng, late_s, fps = np.random.default_rng(3), 0.02, 30.0
    body, swing, rate, phase = (
        rng.normal(size=(12, 3)) * 0.5,
        *(rng.uniform(*bounds, size=(12, 3)) for bounds in ((0.1, 0.4), (2.0, 6.0), (0.0, 6.0))),
    )
    frames = np.concatenate([np.arange(6) + start for start in range(0, 400, 50)])

    def at(seconds: np.ndarray) -> np.ndarray:
        wave = swing * np.sin(rate * seconds[:, None, None] + phase)
        result: np.ndarray = body + wave + [0.0, 0.0, 4.0]
        return result

    middle = at(frames / fps).mean((0, 1))
    other = (at(frames / fps - late_s) - middle) @ TURN.T + middle
    camera = calibrate(at(frames / fps), other, np.ones((len(frames), 12)), frames, fps)
    assert camera.late_s == pytest.approx(late_s, abs=0.004)


@pytest.mark.medium
def test_two_flat_views_make_a_deep_one(dancer: np.ndarray, hip_shake: LandmarkTrack) -> None:
    from robojackson.mocap.views import two_cameras

    plain = replace(MocapConfig(), temporal=replace(MocapConfig().temporal, enabled=False))
    first, second = filmed(dancer, hip_shake), filmed(second_frame(dancer)[15:], hip_shake)
    seen = {}

    def keep(view, config):  # type: ignore[no-untyped-def]
        seen["points"] = view.points
        return finish(view, config)

    finish, two_cameras.finish_motion = two_cameras.finish_motion, keep
    try:
        motion = recover_together(first, second, plain)
    finally:
        two_cameras.finish_motion = finish
    alone = view_track(first, plain).points
    errors = [off(points[15:, BODY], dancer[15:, BODY]) for points in (alone, seen["points"])]
    assert errors[1] < 0.35 * errors[0]
    assert "two cameras" in motion.notes[-1]
    assert len(motion) == len(first)


@pytest.mark.medium
def test_frames_in_which_only_a_face_is_seen_do_not_calibrate(
    dancer: np.ndarray, hip_shake: LandmarkTrack
) -> None:
    visibility = np.ones((len(dancer), 33))
    visibility[3:6, 11:] = 0.0  # shoulders to feet are out of the picture
    tracks = [
        replace(filmed(points, hip_shake), visibility=visibility)
        for points in (dancer, second_frame(dancer))
    ]
    found = recover_together(*tracks, MocapConfig(), 0.0)
    assert np.isfinite(found.keypoints_w).all()


def test_gravity_of_two_cameras_is_that_of_balance(
    dancer: np.ndarray, hip_shake: LandmarkTrack
) -> None:
    """Triangulated points do not lean, one camera's network may err: it has no say here."""
    first, second = filmed(dancer, hip_shake), filmed(second_frame(dancer)[15:], hip_shake)
    together = recover_together(first, second, MocapConfig())
    assert together.camera["gravity"] == "balance"
    assert "gravity_sd_deg" not in together.camera
    assert recover_motion(first, MocapConfig()).camera["gravity"] == "network"


@pytest.mark.medium
def test_weak_frames_of_the_first_camera_are_left_out_on_request(
    dancer: np.ndarray, hip_shake: LandmarkTrack
) -> None:
    first, second = filmed(dancer, hip_shake), filmed(second_frame(dancer)[15:], hip_shake)
    spoilt = np.array(first.landmarks)
    rng = np.random.default_rng(0)
    spoilt[40:46, :, :2] += rng.uniform(-0.25, 0.25, size=spoilt[40:46, :, :2].shape)
    first = replace(first, landmarks=spoilt)
    found = [
        recover_together(first, second, MocapConfig(leave_out_weak=leave_out))
        for leave_out in (False, True)
    ]
    noted = [any("left out" in note for note in motion.notes) for motion in found]
    assert noted == [False, True]
    for motion in found:  # the second camera sees what was left out of the first
        assert motion.valid.all()
        assert not any("interpolated" in note for note in motion.notes)


@pytest.mark.medium
def test_a_frame_is_filled_in_where_neither_camera_sees_the_person(
    dancer: np.ndarray, hip_shake: LandmarkTrack
) -> None:
    plain = replace(MocapConfig(), temporal=replace(MocapConfig().temporal, enabled=False))
    first, second = filmed(dancer, hip_shake), filmed(second_frame(dancer)[15:], hip_shake)
    first = hidden(first, slice(5, 8), slice(40, 46), slice(60, 66))
    second = hidden(second, slice(60 - 15, 66 - 15))
    found = recover_together(first, second, plain, 15 / hip_shake.fps)
    missing = np.flatnonzero(~found.valid)
    assert set(range(5, 8)) | set(range(60, 66)) <= set(missing.tolist())
    assert set(missing.tolist()) <= set(range(5, 8)) | set(range(59, 67))
    assert (found.confidence[40:46] > 0).any(1).all()


@pytest.mark.medium
def test_clips_of_different_motions_are_refused(
    dancer: np.ndarray, hip_shake: LandmarkTrack
) -> None:
    rng = np.random.default_rng(3)
    other = second_frame(dancer)[rng.permutation(len(dancer))]
    with pytest.raises(ViewsDisagree, match="same dance"):
        recover_together(filmed(dancer, hip_shake), filmed(other, hip_shake), MocapConfig())


@pytest.mark.medium
def test_a_second_clip_of_two_frames_is_refused(
    dancer: np.ndarray, hip_shake: LandmarkTrack
) -> None:
    """At 60 frames a second they are shorter than a step of the common clock."""
    short = filmed(second_frame(dancer)[:2], replace(hip_shake, fps=60.0))
    with pytest.raises(ViewsDisagree, match="of one person in common"):
        recover_together(filmed(dancer, hip_shake), short, MocapConfig())


@pytest.mark.medium
def test_two_clips_of_one_camera_are_refused(dancer: np.ndarray, hip_shake: LandmarkTrack) -> None:
    seen = filmed(dancer, hip_shake)
    with pytest.raises(ViewsDisagree, match="from one place"):
        recover_together(seen, seen, MocapConfig(), 0.0)
