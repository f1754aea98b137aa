"""Laws of the world's metrics, and of those beside a truth: hand-worked values."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from robojackson.metrics import dance_score, motion_quality, world_error

FPS = 50.0


def clip(seed: int = 0, frames: int = 230) -> np.ndarray:
    """Return a body of 12 points that walks and trembles, metres."""
    rng = np.random.default_rng(seed)
    home = rng.normal(0.0, 0.4, (1, 12, 3))
    path = np.cumsum(rng.normal(0.0, 0.02, (frames, 1, 3)), axis=0)
    return home + path + rng.normal(0.0, 0.02, (frames, 12, 3))


@given(st.integers(0, 1000))
def test_wa_mpjpe_does_not_see_a_similarity_of_the_clip(seed: int) -> None:
    truth = clip(seed, 40)
    turn = Rotation.random(rng=np.random.default_rng(seed)).as_matrix()
    moved = 1.7 * truth @ turn.T + [3.0, -1.0, 2.0]
    assert world_error.wa_mpjpe(moved, truth) == pytest.approx(0.0, abs=1e-9)
    assert world_error.w_mpjpe(moved, truth) == pytest.approx(0.0, abs=1e-9)


def test_w_mpjpe_sees_a_drift_and_wa_shares_it_out() -> None:
    truth = np.repeat(clip(1, 1), 100, axis=0)
    drift = np.arange(100)[:, None, None] * np.array([0.01, 0.0, 0.0])
    assert world_error.w_mpjpe(truth + drift, truth) > 0.4
    assert world_error.wa_mpjpe(truth + drift, truth) < world_error.w_mpjpe(truth + drift, truth)


def test_pieces_of_a_hundred_frames_are_aligned_by_themselves() -> None:
    truth = clip(2, 200)
    moved = truth.copy()
    moved[100:] += [5.0, 0.0, 0.0]
    assert world_error.wa_mpjpe(moved, truth) == pytest.approx(0.0, abs=1e-9)
    moved[50:] += [5.0, 0.0, 0.0]
    assert world_error.wa_mpjpe(moved, truth) > 0.2


def test_the_clips_own_error_sees_a_jump_wherever_it_is_and_the_scale() -> None:
    truth = clip(2, 200)
    moved = truth.copy()
    moved[100:] += [5.0, 0.0, 0.0]
    assert world_error.clip_mpjpe(moved, truth) > 1.0
    assert world_error.clip_mpjpe(1.1 * truth, truth) > 0.03
    assert world_error.clip_mpjpe(truth + [1.0, 2.0, 3.0], truth) == pytest.approx(0.0, abs=1e-9)


def test_rte_is_the_error_over_the_way() -> None:
    """A path of 4 m that goes astray by 10 cm half way: 5 cm in the mean after the best shift."""
    truth = np.zeros((401, 3))
    truth[:, 0] = np.linspace(0.0, 4.0, 401)
    astray = truth.copy()
    astray[200:, 2] += 0.1
    assert world_error.rte(truth @ Rotation.from_euler("z", 2.0).as_matrix().T, truth) < 1e-9
    assert 0.003 < world_error.rte(astray, truth) < 0.0126


def test_rte_does_not_forgive_scale() -> None:
    truth = np.zeros((101, 3))
    truth[:, 0] = np.linspace(-1.0, 1.0, 101)
    assert world_error.rte(1.2 * truth, truth) == pytest.approx(
        0.2 * np.abs(truth[:, 0]).mean() / 2.0
    )


def test_the_jitter_is_a_tenth_of_the_jerk() -> None:
    time = np.arange(60) / FPS
    cubic = np.stack([0.5 * time**3, 0 * time, 0 * time], -1)[:, None]
    assert motion_quality.jitter(cubic, FPS) == pytest.approx(0.3)


def test_the_acceleration_error_of_a_frozen_pose_is_the_truths_acceleration() -> None:
    truth = clip(3)
    frozen = np.repeat(truth[:1], len(truth), axis=0)
    expected = motion_quality.acceleration(truth, FPS)
    assert motion_quality.acceleration_error(frozen, truth, FPS) == pytest.approx(expected)


def test_foot_sliding_counts_only_feet_that_truly_stand() -> None:
    truth, feet = np.zeros((5, 2, 3)), np.zeros((5, 2, 3))
    truth[:, 1, 0] = 0.02 * np.arange(5)
    feet[:, 0, 1] = 0.003 * np.arange(5)
    feet[:, 1, 0] = 9.0 * np.arange(5)
    assert motion_quality.foot_slide_mm(feet, truth) == pytest.approx(3.0)


def test_f1_by_hand() -> None:
    found = np.array([[1, 1], [0, 1]])
    true = np.array([[1, 0], [1, 1]])
    assert motion_quality.contact_f1(found, true) == pytest.approx(2 * 2 / (3 + 3))
    assert motion_quality.contact_f1(np.zeros(3), np.zeros(3)) == 1.0
    assert motion_quality.contact_f1(np.ones(3), np.zeros(3)) == 0.0


@pytest.mark.parametrize("gain", [0.0, 0.5, 1.0, 1.5])
def test_the_velocity_score_of_a_gain_is_one_minus_its_error_squared(gain: float) -> None:
    truth = clip(4)
    scaled = truth.mean(0) + gain * (truth - truth.mean(0))
    assert dance_score.velocity_score(scaled, truth) == pytest.approx(1.0 - (1.0 - gain) ** 2)


def test_the_velocity_score_of_a_clip_at_rest_is_not_a_number() -> None:
    assert np.isnan(dance_score.velocity_score(clip(5), np.zeros_like(clip(5))))


def test_the_aligned_score_does_not_see_where_the_estimates_world_is() -> None:
    truth = clip(6)
    moved = truth @ Rotation.from_euler("zx", [2.0, 0.1]).as_matrix().T + [1.0, 2.0, 3.0]
    assert dance_score.aligned_velocity_score(moved, truth) == pytest.approx(1.0)
    assert dance_score.velocity_score(moved, truth) < 0.9


def test_the_heading_score_does_not_see_which_way_a_robot_faces() -> None:
    truth = clip(7)
    turn = Rotation.from_euler("z", 1.0)
    moved = turn.apply(truth.reshape(-1, 3)).reshape(truth.shape)
    ahead = np.tile([1.0, 0.0, 0.0, 0.0], (len(truth), 1))
    turned = np.tile(turn.as_quat()[[3, 0, 1, 2]], (len(truth), 1))
    assert dance_score.heading_score(moved, turned, truth, ahead) == pytest.approx(1.0)
    assert dance_score.heading_score(moved, ahead, truth, ahead) < 0.9
