"""Laws of the confidence: it is the inverse matrix, falls for the hidden, follows the error."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.mocap.truth import HIPS, JOINTS, load_truth, video_path
from robojackson.body.skeleton import REST_JOINTS, keypoint
from robojackson.clips.pose_detector import detect
from robojackson.clips.video import VideoLimits, probe
from robojackson.metrics import pose_error
from robojackson.mocap.landmarks import refinement
from robojackson.mocap.landmarks.blazepose import BODY
from robojackson.mocap.landmarks.covariance import covariances, root_relative
from robojackson.mocap.landmarks.refinement import RefineConfig, gather
from robojackson.mocap.recover import MocapConfig, recover_motion
from robojackson.motion.landmark_track import LandmarkTrack

CONFIG = RefineConfig()
FPS = 30.0


def clip(frames: int) -> np.ndarray:
    """Return the landmarks of a person who stands before the camera and sways."""
    rng = np.random.default_rng(3)
    points = rng.uniform(-0.6, 0.6, size=(1, 33, 3)) + [0.0, 0.0, 4.0]
    return points + 0.05 * np.sin(np.arange(frames) / 5.0)[:, None, None]


@pytest.mark.parametrize("frames", [1, 2, 3, 6, 7])
def test_covariances_are_the_blocks_of_the_inverse_of_the_whole_matrix(frames: int) -> None:
    """Against the dense matrix, inverted in full."""
    placed = clip(frames)
    evidence = gather(placed, np.full((frames, 33), 0.9), REST_JOINTS, FPS, CONFIG)
    body = placed[:, BODY]
    jacobian, _ = refinement.residuals(body, evidence, CONFIG)
    dense = np.zeros((36 * frames, 36 * frames))
    for t in range(frames):
        dense[36 * t : 36 * t + 36, 36 * t : 36 * t + 36] = jacobian[t].T @ jacobian[t]
    if frames > 2:
        second = np.kron(np.diff(np.eye(frames), 2, axis=0), np.eye(36))
        stiff = refinement.stiffness(body, FPS, CONFIG).ravel()
        dense += second.T @ np.diag(stiff) @ second
    whole = np.linalg.inv(dense).reshape(frames, 36, frames, 36)
    expected = whole[np.arange(frames), :, np.arange(frames)]
    assert np.allclose(covariances(body, evidence, CONFIG), expected, rtol=1e-4, atol=1e-9)


def test_variance_relative_to_the_hips_forgets_what_all_joints_share() -> None:
    shared = np.tile(np.eye(3), (12, 12))[None]
    assert np.allclose(root_relative(shared), 0.0)


@pytest.mark.medium
def test_a_hidden_arm_is_less_sure_and_the_other_is_not(hip_shake: LandmarkTrack) -> None:
    hidden = np.array(hip_shake.visibility)
    hidden[40:70][:, [13, 15, 17, 19, 21]] = 0.02
    before = recover_motion(hip_shake, MocapConfig()).confidence
    after = recover_motion(replace(hip_shake, visibility=hidden), MocapConfig()).confidence
    left, right = keypoint("left_wrist"), keypoint("right_wrist")
    assert after[45:65, left].max() < 0.7 * before[45:65, left].min()
    assert np.allclose(after[45:65, right], before[45:65, right], atol=0.05)
    assert after[55, left] <= after[42, left]


@pytest.mark.slow
def test_what_is_said_to_be_surer_is_nearer_to_the_truth() -> None:
    truth, path = load_truth("dance_a").joints, video_path("dance_a")
    found = recover_motion(detect(path, probe(path, VideoLimits())), MocapConfig())
    columns = [keypoint(name) for name in JOINTS]
    mine = pose_error.align_clip(found.joints[:, columns], truth, HIPS)
    error = np.linalg.norm(mine - pose_error.root_relative(truth, HIPS), axis=-1)
    result = found.confidence[:, columns]
    order = np.argsort(result.ravel())
    quarter = len(order) // 4
    least, most = order[:quarter], order[-quarter:]
    assert error.ravel()[most].mean() < 0.8 * error.ravel()[least].mean()
