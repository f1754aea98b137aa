"""Laws of the labels of feet: low and still is planted, low and fast slides, high is in the air."""

import numpy as np
import pytest

from benchmarks.mocap.figures import true_contacts
from benchmarks.mocap.truth import SOLE_BELOW_BONE, SOLE_BONES, SOLE_LENGTH, soles
from robojackson.body.forward_kinematics import apply
from robojackson.mocap.grounding.up_direction import camera_to_world
from robojackson.motion.smpl_sequence import AIR, PLANTED, SLIDING

FPS, FRAMES = 30.0, 60


def feet(lifted_m: float, speed_mps: float) -> np.ndarray:
    """Return a right foot that stands at the origin and a left one, lifted and moving."""
    points = np.zeros((FRAMES, 4, 3))
    points[:, :2, 2] = lifted_m
    points[:, :2, 0] = (np.arange(FRAMES) / FPS * speed_mps)[:, None]
    return points


@pytest.mark.parametrize(
    ("lifted_m", "speed_mps", "state"),
    [
        (0.0, 0.0, PLANTED),
        (0.02, 0.0, PLANTED),
        (0.0, 1.0, SLIDING),
        (0.2, 0.0, AIR),
        (0.2, 1.0, AIR),
    ],
)
def test_states_follow_height_and_speed(lifted_m: float, speed_mps: float, state: int) -> None:
    found = true_contacts(feet(lifted_m, speed_mps), FPS)
    assert (found[:, :2] == state).all()
    assert (found[:, 2:] == PLANTED).all()


def test_a_floating_body_stands_on_the_floor_under_it() -> None:
    assert (true_contacts(feet(0.0, 0.0) + [0.0, 0.0, 0.7], FPS) == PLANTED).all()


def test_levelled_axes_keep_lengths_and_put_up_on_z() -> None:
    up = np.array([0.36, -0.48, -0.8])
    points = np.random.default_rng(1).normal(size=(5, 7, 3))
    found = apply(camera_to_world(up), points)
    assert np.allclose(found[..., 2], points @ up)
    assert np.allclose(np.linalg.norm(found, axis=-1), np.linalg.norm(points, axis=-1))


def test_soles_lie_under_their_bones_by_the_size_of_the_foot() -> None:
    bones = np.zeros((3, 4, 3))
    bones[:, [1, 3], 1] = 2.0 * SOLE_LENGTH
    found = soles(bones, list(SOLE_BONES))
    assert np.allclose(found[..., 2], -2.0 * SOLE_BELOW_BONE)
