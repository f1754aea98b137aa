"""Position errors by hand-worked numbers."""

import numpy as np
import pytest

from robojackson.metrics.joint_position_error import acceleration_ratio, mpjpe

RNG = np.random.default_rng(3)
POINTS = RNG.normal(size=(20, 14, 3))
ROOT = RNG.normal(size=(20, 3))


def test_a_shift_of_the_world_counts_in_the_world_alone() -> None:
    moved, root = POINTS + [3.0, 4.0, 0.0], ROOT + [3.0, 4.0, 0.0]
    assert mpjpe(moved, POINTS) == pytest.approx(5.0)
    assert mpjpe(moved, POINTS, root, ROOT) == pytest.approx(0.0, abs=1e-12)


def test_no_rotation_is_removed() -> None:
    turned = POINTS @ np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    assert mpjpe(turned, POINTS, ROOT * 0, ROOT * 0) > 0.5


def test_twice_the_motion_has_twice_the_acceleration() -> None:
    assert acceleration_ratio(2 * POINTS, POINTS) == pytest.approx(2.0)
    assert np.isnan(acceleration_ratio(POINTS[:2], POINTS[:2]))
    assert np.isnan(acceleration_ratio(POINTS, np.zeros_like(POINTS)))
