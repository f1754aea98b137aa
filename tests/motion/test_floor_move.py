"""Moves over the floor are isometries that can be taken back."""

import numpy as np
import pytest

from robojackson.geometry.rotations import heading
from robojackson.motion.floor_move import FloorMove

N = 5


@pytest.fixture
def states() -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(4)
    qpos = rng.normal(size=(2, N, 11))
    qpos[..., 3:7] /= np.linalg.norm(qpos[..., 3:7], axis=-1, keepdims=True)
    return qpos[0], qpos[1]


def test_onto_puts_roots_over_each_other_with_one_heading(
    states: tuple[np.ndarray, np.ndarray],
) -> None:
    qpos, target = states
    moved = FloorMove.onto(qpos, target).qpos(qpos)
    np.testing.assert_allclose(moved[:, :2], target[:, :2], atol=1e-12)
    turn = heading(moved[:, 3:7]) - heading(target[:, 3:7])
    np.testing.assert_allclose(np.cos(turn), 1.0, atol=1e-12)
    np.testing.assert_array_equal(moved[:, [2, *range(7, 11)]], qpos[:, [2, *range(7, 11)]])


def test_the_inverse_takes_states_velocities_and_points_back(
    states: tuple[np.ndarray, np.ndarray],
) -> None:
    qpos, target = states
    move = FloorMove.onto(qpos, target)
    back = move.inverse()
    np.testing.assert_allclose(back.qpos(move.qpos(qpos)), qpos, atol=1e-12)
    np.testing.assert_allclose(back.qvel(move.qvel(qpos[:, :10])), qpos[:, :10], atol=1e-12)
    points = np.random.default_rng(1).normal(size=(N, 7, 3))
    np.testing.assert_allclose(back.points(move.points(points)), points, atol=1e-12)


def test_distances_and_speeds_stay(states: tuple[np.ndarray, np.ndarray]) -> None:
    qpos, target = states
    move = FloorMove.onto(qpos, target)
    points = np.random.default_rng(2).normal(size=(N, 7, 3))
    apart = [np.linalg.norm(np.diff(p, axis=1), axis=-1) for p in (points, move.points(points))]
    np.testing.assert_allclose(*apart)
    np.testing.assert_allclose(
        np.linalg.norm(move.qvel(qpos[:, :10])[:, :3], axis=-1),
        np.linalg.norm(qpos[:, :3], axis=-1),
    )
