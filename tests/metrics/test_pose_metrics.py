"""Laws of the pose metrics: hand-worked values, what each one must not see, and what it must."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import procrustes as scipy_procrustes
from scipy.spatial.transform import Rotation

from robojackson.metrics import pose_error

HIPS = (0, 1)
seeds = st.integers(0, 10_000)


def clip(seed: int, frames: int = 15) -> np.ndarray:
    return np.random.default_rng(seed).normal(scale=0.4, size=(frames, 12, 3))


def turn(seed: int) -> np.ndarray:
    return Rotation.random(rng=np.random.default_rng(seed)).as_matrix()


def test_mpjpe_of_a_constant_offset_is_its_length() -> None:
    assert pose_error.mpjpe(clip(0) + [0.0, 0.03, 0.04], clip(0)) == pytest.approx(0.05)


@given(seeds)
def test_pa_mpjpe_does_not_see_a_similarity_of_each_frame(seed: int) -> None:
    truth = clip(seed)
    turns = Rotation.random(len(truth), rng=np.random.default_rng(seed)).as_matrix()
    scale = np.random.default_rng(seed).uniform(0.5, 2.0, size=(len(truth), 1, 1))
    moved = scale * np.einsum("tij,tnj->tni", turns, truth) + [1.0, 2.0, 3.0]
    assert pose_error.pa_mpjpe(moved, truth) == pytest.approx(0.0, abs=1e-9)


def test_pa_mpjpe_sees_a_mirror() -> None:
    assert pose_error.pa_mpjpe(clip(1) * [-1, 1, 1], clip(1)) > 0.05


def test_procrustes_agrees_with_scipy() -> None:
    a, b = clip(2)[:1], clip(3)[:1]
    fitted = pose_error.procrustes(a, b)(a)
    ours = np.sum((fitted - b) ** 2) / np.sum((b - b.mean(1, keepdims=True)) ** 2)
    reference = scipy_procrustes(b[0], a[0])[2]
    best = min(reference, scipy_procrustes(b[0], a[0] * [-1, 1, 1])[2])
    assert ours >= best - 1e-12
    determinant = np.linalg.det(pose_error.procrustes(a, b).rotation)[0]
    assert determinant == pytest.approx(1.0)


def test_procrustes_without_scale_is_rigid() -> None:
    fit = pose_error.procrustes(2.0 * clip(4), clip(4), scaled=False)
    assert np.allclose(fit.scale, 1.0)


@given(seeds)
def test_root_relative_error_does_not_see_one_rotation_and_any_path(seed: int) -> None:
    truth = clip(seed)
    path = np.random.default_rng(seed + 1).normal(size=(len(truth), 1, 3))
    moved = truth @ turn(seed).T + path
    assert pose_error.rr_mpjpe(moved, truth, HIPS) == pytest.approx(0.0, abs=1e-9)


def test_root_relative_error_sees_scale() -> None:
    truth = clip(5)
    expected = 0.1 * np.linalg.norm(pose_error.root_relative(truth, HIPS), axis=-1).mean()
    assert pose_error.rr_mpjpe(1.1 * truth, truth, HIPS) == pytest.approx(expected)


def test_root_relative_error_sees_a_rotation_of_half_the_clip() -> None:
    truth = clip(6)
    moved = truth.copy()
    moved[:7] = moved[:7] @ turn(6).T
    assert pose_error.rr_mpjpe(moved, truth, HIPS) > 0.05


@given(seeds)
def test_errors_are_at_least_zero_and_pa_is_least(seed: int) -> None:
    mine, truth = clip(seed), clip(seed + 1)
    squared = [np.sum((pose_error.procrustes(mine, truth)(mine) - truth) ** 2)]
    centred = mine - mine.mean(1, keepdims=True) + truth.mean(1, keepdims=True)
    squared.append(np.sum((centred - truth) ** 2))
    assert 0.0 <= squared[0] <= squared[1]


def test_mpjve_does_not_see_a_constant_offset() -> None:
    assert pose_error.mpjve(clip(7) + 0.3, clip(7), 30.0) == pytest.approx(0.0, abs=1e-9)


def test_mpjve_of_a_drift_is_its_speed() -> None:
    drift = np.arange(15)[:, None, None] * np.array([0.01, 0.0, 0.0])
    assert pose_error.mpjve(clip(8) + drift, clip(8), 30.0) == pytest.approx(0.3)


def test_a_frozen_pose_has_the_velocity_error_of_the_whole_motion() -> None:
    truth = clip(9)
    frozen = np.repeat(truth[:1], len(truth), axis=0)
    assert pose_error.mpjve(frozen, truth, 30.0) > 0.5
