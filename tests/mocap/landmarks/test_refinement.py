"""Laws of the whole-clip refinement: a perfect clip stays, a noisy one gets nearer to the truth."""

from dataclasses import replace

import numpy as np
import pytest

from robojackson.body.skeleton import REST_JOINTS, keypoint
from robojackson.mocap.landmarks import refinement
from robojackson.mocap.landmarks.blazepose import BODY, landmark
from robojackson.mocap.landmarks.refinement import BONES, ORDER, RefineConfig, bone_lengths, refine

FPS = 30.0
FRAMES = 45
VISIBLE = np.ones((FRAMES, 33))
CONFIG = RefineConfig()


def true_clip() -> np.ndarray:
    """Return the rest pose, swaying slowly before the camera, as 33 landmarks in the camera
    frame."""
    upright = REST_JOINTS * [1.0, -1.0, -1.0]
    points = np.zeros((FRAMES, 33, 3))
    for index in BODY:
        points[:, index] = upright[keypoint(ORDER[list(BODY).index(index)])]
    sway = 0.1 * np.sin(2.0 * np.pi * 0.5 * np.arange(FRAMES) / FPS)
    return points + [0.0, 0.0, 4.0] + sway[:, None, None] * [1.0, 0.0, 0.0]


def with_noisy_depth(points: np.ndarray, spread: float, seed: int) -> np.ndarray:
    """Return landmarks with the same image and wrong depths."""
    depth = points[..., 2:] + np.random.default_rng(seed).normal(scale=spread, size=(FRAMES, 33, 1))
    return np.concatenate([points[..., :2] / points[..., 2:] * depth, depth], -1)


def error(points: np.ndarray) -> float:
    relative = points[:, BODY] - points[:, BODY].mean(1, keepdims=True)
    truth = true_clip()[:, BODY]
    goal = truth - truth.mean(1, keepdims=True)
    return float(np.linalg.norm(relative - goal, axis=-1).mean())


def test_a_perfect_clip_hardly_changes() -> None:
    assert error(refine(true_clip(), VISIBLE, REST_JOINTS, FPS, CONFIG)) < 0.003


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_wrong_depths_come_nearer_to_the_truth(seed: int) -> None:
    noisy = with_noisy_depth(true_clip(), 0.08, seed)
    assert error(refine(noisy, VISIBLE, REST_JOINTS, FPS, CONFIG)) < 0.6 * error(noisy)


def test_bones_come_nearer_to_the_persons_lengths() -> None:
    noisy = with_noisy_depth(true_clip(), 0.08, 3)
    refined = refine(noisy, VISIBLE, REST_JOINTS, FPS, CONFIG)
    ends = np.array([[landmark(a), landmark(b)] for a, b in BONES])

    def worst(points: np.ndarray) -> float:
        bones = np.linalg.norm(points[:, ends[:, 1]] - points[:, ends[:, 0]], axis=-1)
        return float(np.abs(bones - bone_lengths(REST_JOINTS)).mean())

    assert worst(refined) < 0.2 * worst(noisy)


def test_a_clip_of_few_frames_is_not_smoothed_away() -> None:
    """An arm that swings by 40 cm once a second, thinned to ten frames a second."""
    moving = true_clip()
    time = np.arange(FRAMES) / FPS
    moving[:, BODY[4], 1] += 0.4 * np.sin(2.0 * np.pi * time)
    slow = moving[::3]
    found = refine(slow, VISIBLE[::3], REST_JOINTS, FPS / 3.0, CONFIG)
    swing = np.ptp(found[:, BODY[4], 1]) / np.ptp(slow[:, BODY[4], 1])
    assert 0.85 < swing < 1.1


def test_one_step_is_that_of_a_dense_solver() -> None:
    """The banded matrix against the same normal equations written out in full."""
    body = with_noisy_depth(true_clip(), 0.05, 4)[:8, BODY]
    evidence = refinement.Evidence(
        rays=body[..., :2] / body[..., 2:] + 0.001,
        depth=body[..., 2] - 4.0,
        trust=np.ones((8, 12)),
        lengths=bone_lengths(REST_JOINTS),
        fps=FPS,
        depth_m=np.full((8, 12), CONFIG.depth_m),
    )
    jacobian, residual = refinement.residuals(body, evidence, CONFIG)
    dense = np.zeros((8 * 36, 8 * 36))
    moment = np.zeros(8 * 36)
    for frame in range(8):
        part = slice(36 * frame, 36 * (frame + 1))
        dense[part, part] = jacobian[frame].T @ jacobian[frame]
        moment[part] = jacobian[frame].T @ residual[frame]
    second = np.kron(np.diff(np.eye(8), 2, axis=0), np.eye(36))
    smooth = second.T @ np.diag(refinement.stiffness(body, FPS, CONFIG).ravel()) @ second
    dense += smooth
    moment += smooth @ body.reshape(-1)
    expected = np.linalg.solve(dense, -moment).reshape(body.shape)
    assert np.allclose(refinement._step(body, evidence, CONFIG), expected, atol=1e-9)


def test_derivatives_are_those_of_finite_differences() -> None:
    body = with_noisy_depth(true_clip(), 0.05, 5)[:1, BODY]
    lengths = bone_lengths(REST_JOINTS)
    evidence = refinement.Evidence(
        body[..., :2] / body[..., 2:],
        body[..., 2] - 4.0,
        np.ones((1, 12)),
        lengths,
        FPS,
        np.full((1, 12), CONFIG.depth_m),
    )
    analytic = refinement._bones(body, evidence, 0.01)[0].reshape(len(BONES), 36)
    numeric = np.empty_like(analytic)
    for column in range(36):
        step = np.zeros(36)
        step[column] = 1e-6
        ends = [body + sign * step.reshape(1, 12, 3) for sign in (1, -1)]
        high, low = (refinement._bones(end, evidence, 0.01)[1][0] for end in ends)
        numeric[:, column] = (high - low) / 2e-6
    assert np.allclose(analytic, numeric, atol=1e-5)


def test_hands_and_feet_follow_what_they_hang_on() -> None:
    placed = true_clip()
    body = placed[:, BODY].copy()
    body[:, ORDER.index("left_wrist")] += [0.1, 0.0, 0.0]
    moved = refinement.carry_along(placed, body)
    assert np.allclose(
        moved[:, landmark("left_index")] - placed[:, landmark("left_index")], [0.1, 0, 0]
    )
    assert np.allclose(moved[:, landmark("right_heel")], placed[:, landmark("right_heel")])


def test_an_unseen_landmark_gives_way_more() -> None:
    noisy = true_clip()
    wrist = landmark("left_wrist")
    noisy[20, wrist, 0] += 0.3
    hidden = VISIBLE.copy()
    hidden[20, wrist] = 0.0
    seen = refine(noisy, VISIBLE, REST_JOINTS, FPS, CONFIG)[20, wrist, 0]
    unseen = refine(noisy, hidden, REST_JOINTS, FPS, CONFIG)[20, wrist, 0]
    truth = true_clip()[20, wrist, 0]
    assert abs(unseen - truth) < abs(seen - truth)


@pytest.mark.parametrize("frames", [2, 3])
def test_very_short_clips_are_refined(frames: int) -> None:
    clip = true_clip()[:frames]
    refined = refine(clip, VISIBLE[:frames], REST_JOINTS, FPS, replace(CONFIG, rounds=2))
    assert np.isfinite(refined).all()
