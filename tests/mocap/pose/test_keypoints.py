"""Laws of the keypoints: they turn with the person, and a T-pose gives the T-pose."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from robojackson.body.skeleton import (
    KEYPOINT_NAMES,
    PARENTS,
    REST_JOINTS,
    keypoint,
    pair,
    rest_offset,
)
from robojackson.errors import UnknownName
from robojackson.mocap.landmarks.blazepose import MIRROR
from robojackson.mocap.landmarks.bone_lengths import fit_skeleton
from robojackson.mocap.pose.keypoints import build
from robojackson.motion.landmark_track import LandmarkTrack

TURN = Rotation.from_rotvec([0.3, -0.8, 1.9]).as_matrix()


def test_turning_the_landmarks_turns_the_keypoints(hip_shake: LandmarkTrack) -> None:
    marks, seen = hip_shake.world_landmarks, hip_shake.visibility
    turned = build(marks @ TURN.T, seen)
    assert np.allclose(turned.points, build(marks, seen).points @ TURN.T, atol=1e-9)
    assert np.allclose(turned.chest, TURN @ build(marks, seen).chest, atol=1e-9)


def test_every_keypoint_is_defined(hip_shake: LandmarkTrack) -> None:
    assert not np.isnan(build(hip_shake.world_landmarks, hip_shake.visibility).points).any()


def test_limb_joints_are_the_landmarks(hip_shake: LandmarkTrack) -> None:
    points = build(hip_shake.world_landmarks, hip_shake.visibility).points
    assert np.allclose(points[:, keypoint("right_wrist")], hip_shake.world_landmarks[:, 16])


def test_middle_of_the_hips_is_kept(hip_shake: LandmarkTrack) -> None:
    points = build(hip_shake.world_landmarks, hip_shake.visibility).points
    middle = hip_shake.world_landmarks[:, [23, 24]].mean(1)
    assert np.allclose(points[:, list(pair("hip"))].mean(1), middle, atol=1e-9)


def test_spine_leads_from_the_pelvis_to_the_neck_without_turning_back(
    hip_shake: LandmarkTrack,
) -> None:
    points = build(hip_shake.world_landmarks, hip_shake.visibility).points
    chain = points[:, [keypoint(n) for n in ("pelvis", "spine1", "spine2", "spine3", "neck")]]
    along = chain[:, -1] - chain[:, 0]
    assert (np.einsum("tki,ti->tk", np.diff(chain, axis=1), along) > 0).all()


def test_a_mirrored_person_gives_mirrored_keypoints(hip_shake: LandmarkTrack) -> None:
    flip = np.array([-1.0, 1.0, 1.0])
    marks = hip_shake.world_landmarks
    mirrored = build(marks[:, MIRROR] * flip, hip_shake.visibility[:, MIRROR])
    ours = build(marks, hip_shake.visibility)
    left, right = pair("elbow")
    assert np.allclose(mirrored.points[:, left], ours.points[:, right] * flip, atol=1e-9)
    spine = keypoint("spine2")
    assert np.allclose(mirrored.points[:, spine], ours.points[:, spine] * flip, atol=1e-9)


def test_an_occluded_wrist_lowers_only_its_own_confidence(hip_shake: LandmarkTrack) -> None:
    hidden = np.full_like(hip_shake.visibility, 0.9)
    hidden[:, 15] = 0.1
    confidence = build(hip_shake.world_landmarks, hidden).confidence
    assert np.allclose(confidence[:, keypoint("left_wrist")], 0.1)
    assert np.allclose(np.delete(confidence, keypoint("left_wrist"), axis=1), 0.9)


def test_rest_skeleton_is_symmetric() -> None:
    for name in ("hip", "knee", "ankle", "foot", "shoulder", "elbow", "hand", "middle"):
        left, right = pair(name)
        assert np.allclose(REST_JOINTS[left] * [-1, 1, 1], REST_JOINTS[right])


def test_rest_skeleton_is_an_adult_in_a_t_pose() -> None:
    height = REST_JOINTS[keypoint("head_top"), 1] - REST_JOINTS[keypoint("left_ankle"), 1]
    assert height == pytest.approx(1.67, abs=0.03)
    assert REST_JOINTS[keypoint("left_wrist"), 0] > 0.6


def test_fitted_skeleton_is_symmetric_with_the_medians_at_full_trust(
    hip_shake: LandmarkTrack,
) -> None:
    marks = hip_shake.world_landmarks
    rest = fit_skeleton(marks, trust=1.0)
    left, right = pair("elbow")
    assert np.allclose(rest[left] * [-1, 1, 1], rest[right])
    thighs = [np.linalg.norm(marks[:, k] - marks[:, h], axis=-1) for h, k in ((23, 25), (24, 26))]
    fitted = np.linalg.norm(rest[pair("knee")[0]] - rest[pair("hip")[0]])
    assert fitted == pytest.approx(np.median(np.mean(thighs, 0)))


def test_skeleton_without_trust_has_the_rest_proportions(hip_shake: LandmarkTrack) -> None:
    rest = fit_skeleton(hip_shake.world_landmarks, trust=0.0)
    parents = np.array(PARENTS[1:])
    ratio = np.linalg.norm(rest[1:] - rest[parents], axis=-1) / np.linalg.norm(
        REST_JOINTS[1:] - REST_JOINTS[parents], axis=-1
    )
    assert np.allclose(ratio, ratio[0])


def test_skeleton_grows_with_the_person(hip_shake: LandmarkTrack) -> None:
    small = fit_skeleton(hip_shake.world_landmarks, 0.5)
    assert np.allclose(fit_skeleton(1.3 * hip_shake.world_landmarks, 0.5), 1.3 * small)


def test_unknown_keypoint_names_the_known_ones() -> None:
    with pytest.raises(UnknownName, match="left_hand"):
        keypoint("left_thumb")


def test_offsets_of_the_right_side_mirror_the_left() -> None:
    assert np.allclose(rest_offset("right_knee"), rest_offset("left_knee") * [-1, 1, 1])
    assert len(KEYPOINT_NAMES) == 29
