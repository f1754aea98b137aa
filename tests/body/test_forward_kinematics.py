"""Laws of swing, twist, forward kinematics and fits of rotations."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from robojackson.body.forward_kinematics import (
    align,
    any_normal,
    apply,
    forward,
    kabsch,
    rotate_about,
    split,
    swing,
    triad,
    twist,
    unit,
)
from robojackson.body.skeleton import PARENTS, REST_JOINTS


def random_matrices(count: int, seed: int = 0) -> np.ndarray:
    return Rotation.random(count, rng=np.random.default_rng(seed)).as_matrix()


def test_swing_times_twist_restores_the_rotation() -> None:
    rotation = random_matrices(500)
    bone = np.random.default_rng(1).normal(size=(500, 3))
    swung, cos_sin = split(rotation, bone)
    assert np.allclose(swung @ twist(bone, cos_sin), rotation, atol=1e-9)


def test_swing_brings_one_direction_onto_the_other() -> None:
    a, b = np.random.default_rng(2).normal(size=(2, 300, 3))
    assert np.allclose(apply(swing(a, b), unit(a)), unit(b), atol=1e-12)


def test_swing_is_the_shortest_way() -> None:
    a, b = np.random.default_rng(3).normal(size=(2, 300, 3))
    turned = Rotation.from_matrix(swing(a, b)).magnitude()
    assert np.allclose(turned, np.arccos(np.sum(unit(a) * unit(b), -1)), atol=1e-7)


@pytest.mark.parametrize("angle", [1e-9, 1e-7, 1e-5, np.pi - 1e-5, np.pi - 1e-7, np.pi])
def test_swing_is_a_rotation_near_the_same_and_the_opposite_direction(angle: float) -> None:
    start = np.array([[0.3, -0.2, 0.9]])
    end = apply(rotate_about(any_normal(start), np.cos([angle]), np.sin([angle])), start)
    turn = swing(start, end)
    assert np.allclose(turn @ turn.swapaxes(-1, -2), np.eye(3), atol=1e-9)
    assert np.allclose(apply(turn, start), end, atol=1e-7)


def test_a_bone_of_no_length_is_not_swung() -> None:
    assert np.allclose(swing(np.zeros((1, 3)), np.array([[0.0, 1.0, 0.0]])), np.eye(3))


def test_twist_leaves_its_bone_and_turns_like_scipy() -> None:
    bone, angle = np.array([0.1, 0.4, -0.3]), 0.7
    expected = Rotation.from_rotvec(angle * bone / np.linalg.norm(bone)).as_matrix()
    assert np.allclose(twist(bone, 3.0 * np.array([np.cos(angle), np.sin(angle)])), expected)


def test_forward_kinematics_keeps_every_bone_length() -> None:
    local = random_matrices(20 * 24).reshape(20, 24, 3, 3)
    points = forward(local, REST_JOINTS[None], np.zeros((20, 3))).points
    parents = np.array(PARENTS[1:])
    lengths = np.linalg.norm(points[:, 1:] - points[:, parents], axis=-1)
    rest = np.linalg.norm(REST_JOINTS[1:] - REST_JOINTS[parents], axis=-1)
    assert np.allclose(lengths, rest)


def test_forward_kinematics_of_the_identity_is_the_rest_pose() -> None:
    local = np.broadcast_to(np.eye(3), (1, 24, 3, 3)).copy()
    assert np.allclose(forward(local, REST_JOINTS[None], REST_JOINTS[:1]).points[0], REST_JOINTS)


def test_a_bent_elbow_moves_the_wrist_by_hand_worked_numbers() -> None:
    local = np.broadcast_to(np.eye(3), (1, 24, 3, 3)).copy()
    local[0, 18] = Rotation.from_euler("y", -90, degrees=True).as_matrix()
    pose = forward(local, REST_JOINTS[None], REST_JOINTS[:1])
    assert np.allclose(pose.points[0, 20], REST_JOINTS[18] + [0.0, 0.0, 0.25])


def test_kabsch_finds_the_rotation_and_never_a_mirror() -> None:
    rotation = random_matrices(100, 5)
    flat = np.random.default_rng(6).normal(size=(100, 3, 3)) * [1.0, 1.0, 0.0]
    found = kabsch(flat, np.einsum("tij,tnj->tni", rotation, flat))
    assert np.allclose(found, rotation, atol=1e-7)


def test_triad_is_right_handed_and_starts_along_the_primary() -> None:
    primary, secondary = np.random.default_rng(7).normal(size=(2, 50, 3))
    frame = triad(primary, secondary)
    assert np.allclose(np.linalg.det(frame), 1.0)
    assert np.allclose(frame[..., 0], unit(primary))


def test_align_undoes_a_rotation_of_both_vectors() -> None:
    rotation = random_matrices(50, 8)
    first, second = np.array([0.0, 1.0, 0.2]), np.array([1.0, 0.0, 0.0])
    found = align((first, second), (apply(rotation, first), apply(rotation, second)))
    assert np.allclose(found, rotation)
