"""Laws of quaternions and axis changes, against scipy."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from robojackson.geometry import frames, rotations

seeds = st.integers(0, 10_000)


def random_quats(seed: int, shape: tuple[int, ...] = (20,)) -> np.ndarray:
    quats = np.random.default_rng(seed).normal(size=(*shape, 4))
    return quats / np.linalg.norm(quats, axis=-1, keepdims=True)


@given(seeds)
def test_product_turns_as_scipys_product(seed: int) -> None:
    a, b = random_quats(seed), random_quats(seed + 1)
    expected = (rotations.to_rotation(a) * rotations.to_rotation(b)).as_matrix()
    ours = rotations.quat_to_matrix(rotations.quat_multiply(a, b))
    assert np.allclose(ours, expected)


@given(seeds)
def test_conjugate_undoes(seed: int) -> None:
    quats = random_quats(seed)
    product = rotations.quat_multiply(quats, rotations.quat_conjugate(quats))
    assert np.allclose(product, [1, 0, 0, 0])


def test_matrix_is_that_of_scipy_over_any_batch() -> None:
    quats = random_quats(0, (2, 3, 5))
    flat = Rotation.from_quat(quats.reshape(-1, 4)[:, [1, 2, 3, 0]]).as_matrix()
    assert np.allclose(rotations.quat_to_matrix(quats).reshape(-1, 3, 3), flat)


def test_round_trip_through_scipy_keeps_the_rotation() -> None:
    quats = random_quats(1)
    back = rotations.from_rotation(rotations.to_rotation(quats))
    assert np.allclose(np.abs(np.sum(back * quats, -1)), 1.0)


@given(seeds)
def test_angle_is_that_of_the_difference(seed: int) -> None:
    a, b = random_quats(seed), random_quats(seed + 1)
    difference = rotations.to_rotation(a).inv() * rotations.to_rotation(b)
    assert np.allclose(rotations.quat_angle(a, b), difference.magnitude(), atol=1e-6)


def test_angle_does_not_see_the_sign() -> None:
    a, b = random_quats(2), random_quats(3)
    assert np.allclose(rotations.quat_angle(a, -b), rotations.quat_angle(a, b))


def test_sign_continuity_changes_signs_only_and_leaves_no_jump() -> None:
    angles = np.linspace(0, 4 * np.pi, 100)
    quats = rotations.from_rotation(Rotation.from_euler("z", angles[:, None]))
    smooth = rotations.sign_continuous(quats * np.sign(np.cos(9 * angles))[:, None])
    assert (np.sum(smooth[1:] * smooth[:-1], -1) > 0).all()
    assert np.allclose(np.abs(np.sum(smooth * quats, -1)), 1.0)


@pytest.mark.parametrize("yaw", [-3.0, -0.5, 0.0, 1.2, 3.1])
def test_heading_is_the_yaw_whatever_pitch_and_roll(yaw: float) -> None:
    quat = rotations.from_rotation(Rotation.from_euler("ZYX", [yaw, 0.4, -0.3]))
    assert rotations.heading(quat) == pytest.approx(yaw)


@pytest.mark.parametrize("change", [frames.SMPL_TO_WORLD, frames.CAMERA_TO_WORLD])
def test_axis_changes_are_isometries_that_keep_handedness(change: np.ndarray) -> None:
    assert np.allclose(change @ change.T, np.eye(3))
    assert np.linalg.det(change) == pytest.approx(1.0)


def test_smpl_forward_left_and_up_become_the_worlds() -> None:
    left, up, forward = np.eye(3)
    assert np.allclose(frames.SMPL_TO_WORLD @ forward, [1, 0, 0])
    assert np.allclose(frames.SMPL_TO_WORLD @ left, [0, 1, 0])
    assert np.allclose(frames.SMPL_TO_WORLD @ up, [0, 0, 1])


def test_a_camera_looks_back_along_the_worlds_x() -> None:
    assert np.allclose(frames.CAMERA_TO_WORLD @ [0, 0, 1], [-1, 0, 0])
    assert np.allclose(frames.CAMERA_TO_WORLD @ [0, 1, 0], [0, 0, -1])
