"""The red team of the dance metrics: whatever does not dance must score below the dance."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from robojackson.metrics.rollout_score import (
    best_frozen_error,
    heading_frame,
    limb_response,
    site_error,
    skill,
)

DT = 0.015
TIME = np.arange(400) * DT


def dance(amplitude: float = 0.3, lag_s: float = 0.0) -> np.ndarray:
    """Return 14 points that sway, each with its own phase, shape (400, 14, 3)."""
    phase = np.arange(14)[None, :, None] + np.arange(3)[None, None]
    home = np.random.default_rng(0).normal(0, 0.5, (1, 14, 3))
    return home + amplitude * np.sin(2 * np.pi * (TIME[:, None, None] - lag_s) / 2 + phase)


def skill_of(points: np.ndarray) -> float:
    expected = dance()
    return skill(float(site_error(points, expected).mean()), best_frozen_error(expected))


def test_the_dance_itself_has_skill_one() -> None:
    assert skill_of(dance()) == pytest.approx(1.0)


@pytest.mark.parametrize(
    "cheat",
    [
        np.broadcast_to(dance()[0], dance().shape),
        np.broadcast_to(dance().mean(0), dance().shape),
        dance() * [1, -1, 1],
        dance() + np.random.default_rng(1).normal(0, 0.5, dance().shape),
    ],
    ids=["first pose", "mean pose", "mirrored", "flail"],
)
def test_what_does_not_dance_has_no_skill(cheat: np.ndarray) -> None:
    assert skill_of(cheat) <= 1e-9


def test_half_the_amplitude_and_a_lag_have_less_skill() -> None:
    half = dance().mean(0) + (dance() - dance().mean(0)) / 2
    assert skill_of(half) < 0.6
    assert skill_of(dance(lag_s=0.2)) < 0.6


def test_the_heading_frame_ignores_where_and_which_way() -> None:
    points, root = dance()[:5], np.tile([1.0, 0, 0, 0], (5, 1))
    turn = Rotation.from_euler("z", 1.1)
    moved = turn.apply(points.reshape(-1, 3)).reshape(points.shape) + [3.0, -2.0, 0.4]
    turned = np.tile(turn.as_quat()[[3, 0, 1, 2]], (5, 1))
    np.testing.assert_allclose(
        heading_frame(moved, turned, 0), heading_frame(points, root, 0), atol=1e-12
    )


@pytest.mark.parametrize("gain", [0.5, 1.0, 2.0])
def test_the_gain_of_a_limb_is_its_amplitude(gain: float) -> None:
    expected = dance()[:, 3]
    limb = expected.mean(0) + gain * (expected - expected.mean(0))
    found = limb_response(limb, expected, DT, fast=0.15, max_lag=0.1)
    assert found is not None
    assert found.gain == pytest.approx(gain)
    assert found.r2 == pytest.approx(1 - (1 - gain) ** 2)


def test_the_lag_of_a_limb_is_found() -> None:
    found = limb_response(dance(lag_s=0.06)[:, 3], dance()[:, 3], DT, fast=0.15, max_lag=0.1)
    assert found is not None
    assert found.lag_s == pytest.approx(0.06)
    assert found.gain == pytest.approx(1.0, abs=0.01)


def test_a_limb_that_flails_where_the_reference_rests_has_excess_speed() -> None:
    rest = np.zeros((400, 3))
    found = limb_response(dance()[:, 3], rest, DT, fast=0.15, max_lag=0.1)
    assert found is not None
    assert found.moving_share == 0
    assert found.excess_m_s > 0.3
