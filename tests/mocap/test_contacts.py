"""Laws of contacts, of feet that are held, and of the path that keeps them still."""

import numpy as np
import pytest

from robojackson.mocap import feet as soles
from robojackson.mocap import lock
from robojackson.mocap.contacts import ContactConfig, contacts, hysteresis, join_short
from robojackson.mocap.kinematics import forward
from robojackson.mocap.skeleton import REST_JOINTS, keypoint, pair
from robojackson.motion.smpl import AIR, PLANTED, SLIDING

FPS = 30.0
FRAMES = 40
FALLING = np.zeros(FRAMES, bool)
CONFIG = ContactConfig()


def four_feet(height: float = 0.0, speed: float = 0.0) -> np.ndarray:
    """Four points at a height that move sideways (y) at a speed."""
    feet = np.zeros((FRAMES, 4, 3))
    feet[..., 2] = height
    feet[..., 1] = (np.arange(FRAMES) / FPS * speed)[:, None]
    return feet


def test_still_feet_on_the_floor_are_planted() -> None:
    assert (contacts(four_feet(), FALLING, FPS, CONFIG) == PLANTED).all()


def test_feet_that_glide_over_the_floor_slide() -> None:
    assert (contacts(four_feet(speed=1.0), FALLING, FPS, CONFIG) == SLIDING).all()


def test_a_raised_foot_is_in_the_air() -> None:
    feet = four_feet()
    feet[:, 2:, 2] = 0.3
    assert (contacts(feet, FALLING, FPS, CONFIG) == [PLANTED, PLANTED, AIR, AIR]).all()


def test_nobody_levitates_outside_free_fall() -> None:
    states = contacts(four_feet(height=0.4), FALLING, FPS, CONFIG)
    assert (states != AIR).any(1).all()


def test_in_free_fall_nothing_has_to_touch() -> None:
    states = contacts(four_feet(height=0.4), ~FALLING, FPS, CONFIG)
    assert (states == AIR).all()


def test_hysteresis_changes_only_beyond_both_thresholds() -> None:
    values = np.array([0.0, 0.6, 0.9, 1.1, 0.9, 0.6, 0.4, 0.9])
    expected = [True, True, True, False, False, False, True, True]
    assert hysteresis(values, on=0.5, off=1.0).tolist() == expected


def test_short_runs_join_the_state_before() -> None:
    states = np.array([1, 1, 0, 1, 1, 1, 0, 0, 0], bool)
    assert join_short(states, 2).tolist() == [1, 1, 1, 1, 1, 1, 0, 0, 0]


def test_root_correction_undoes_a_drift_that_planted_feet_reveal() -> None:
    feet = four_feet()
    drift = 0.05 * np.arange(FRAMES) / FRAMES
    feet[..., 1] += drift[:, None]
    shift = lock.root_correction(feet, np.ones((FRAMES, 4), bool), FPS, lock.LockConfig())
    assert np.ptp((feet + shift[:, None])[:, 0, 1]) < 0.1 * drift.max()


def test_root_correction_without_contact_is_nothing() -> None:
    planted = np.zeros((FRAMES, 4), bool)
    shift = lock.root_correction(four_feet(speed=1.0), planted, FPS, lock.LockConfig())
    assert np.allclose(shift, 0.0)


def test_root_correction_minimises_its_cost() -> None:
    """Against a dense least-squares solution of the same residuals."""
    rng = np.random.default_rng(0)
    hold, pull = rng.uniform(0, 9, 11), rng.normal(size=11)
    spread, wobble = 0.3, 0.2
    first = np.diff(np.eye(12), axis=0)
    second = np.diff(np.eye(12), 2, axis=0)
    normal = (
        np.eye(12) / spread**2 + first.T @ (hold[:, None] * first) + second.T @ second / wobble**2
    )
    expected = np.linalg.solve(normal, -first.T @ pull)
    assert np.allclose(lock._smoothest(hold, pull, spread, wobble), expected)


def test_pinned_feet_stand_still_on_the_floor() -> None:
    feet = four_feet(height=0.02)
    feet[..., 0] += 0.01 * np.random.default_rng(1).normal(size=(FRAMES, 1))
    moved = feet + np.repeat(lock.pin_offsets(feet, np.ones((FRAMES, 4), bool)), 2, axis=1)
    assert np.ptp(moved, axis=0).max() < 1e-12
    assert np.allclose(moved[..., 2], 0.0)


def test_moving_a_foot_keeps_the_leg_lengths_and_reaches_the_goal() -> None:
    points = np.repeat(REST_JOINTS[None], FRAMES, axis=0)
    hip, knee, ankle = (pair(name)[0] for name in ("hip", "knee", "ankle"))
    points[:, knee, 2] += 0.1
    offsets = np.zeros((FRAMES, 2, 3))
    offsets[:, 0] = [0.05, 0.08, 0.03]
    moved = lock.move_feet(points, offsets)
    for a, b in ((hip, knee), (knee, ankle)):
        before = np.linalg.norm(points[:, a] - points[:, b], axis=-1)
        assert np.allclose(np.linalg.norm(moved[:, a] - moved[:, b], axis=-1), before)
    assert np.allclose(moved[:, ankle], points[:, ankle] + offsets[:, 0])
    assert np.allclose(moved[:, pair("knee")[1]], points[:, pair("knee")[1]])


def test_a_goal_out_of_reach_stretches_the_leg_and_no_more() -> None:
    hip, knee, ankle = np.zeros((1, 3)), np.array([[0.1, 0, -0.4]]), np.array([[0, 0, -0.8]])
    reached = lock.reach(hip, knee, ankle, np.array([[0.0, 0.0, -2.0]]))[1]
    length = 2.0 * np.hypot(0.1, 0.4)
    assert reached[0, 2] == pytest.approx(-length, rel=1e-3)


def test_body_follows_the_height_that_the_standing_feet_share() -> None:
    offsets = np.zeros((FRAMES, 2, 3))
    offsets[:, 0, 2], offsets[:, 1, 2] = 0.01, 0.03
    planted = np.ones((FRAMES, 4), bool)
    assert np.allclose(lock.shared_height(offsets, planted), [0.0, 0.0, 0.02])
    planted[:, 2:] = False
    assert np.allclose(lock.shared_height(offsets, planted), [0.0, 0.0, 0.01])


def test_lift_takes_the_lower_end_of_a_foot_to_the_floor() -> None:
    feet = four_feet()
    feet[:, 1, 2] = -0.04
    assert np.allclose(lock.lift_offsets(feet)[:, :, 2], [0.04, 0.0])


def test_sole_of_the_rest_pose_is_flat() -> None:
    local = np.broadcast_to(np.eye(3), (1, 24, 3, 3)).copy()
    upright = np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0]], float)
    local[:, 0] = upright
    pose = forward(local, REST_JOINTS[None], np.zeros((1, 3)))
    assert np.allclose(soles.pitch(soles.foot_points(pose, REST_JOINTS)), 0.0, atol=0.02)


def test_pitch_bias_is_that_of_the_standing_frames() -> None:
    feet = np.zeros((FRAMES, 4, 3))
    feet[:, 1::2, 0] = 0.2
    feet[:, 0::2, 2] = 0.2 * np.tan(0.3)
    feet[:10, :, 2] += 0.5 * np.arange(10)[::-1, None]
    feet[:10, 1, 2] += 0.3
    assert soles.pitch_bias(feet, FPS) == pytest.approx(-0.3, abs=1e-6)


def test_turning_the_feet_by_the_bias_levels_them() -> None:
    points = np.repeat(REST_JOINTS[None, :, [2, 0, 1]], 2, axis=0)
    toe, ankle = keypoint("left_big_toe"), keypoint("left_ankle")
    turned = soles.turn_feet(points, np.full((2, 2), 0.2))
    before, after = points[0, toe] - points[0, ankle], turned[0, toe] - turned[0, ankle]
    angles = [np.arctan2(v[2], np.hypot(v[0], v[1])) for v in (before, after)]
    assert angles[1] - angles[0] == pytest.approx(-0.2)


def test_held_feet_keep_one_heading_while_they_stand() -> None:
    rng = np.random.default_rng(4)
    points = np.repeat(REST_JOINTS[None, :, [2, 0, 1]], FRAMES, axis=0)
    toes = [keypoint("left_big_toe"), keypoint("left_foot")]
    points[:, toes] += 0.02 * rng.normal(size=(FRAMES, 2, 3))
    feet = np.zeros((FRAMES, 4, 3))
    feet[:, 1::2] = [0.2, 0.0, 0.0] + 0.02 * rng.normal(size=(FRAMES, 2, 3))
    flat = np.ones((FRAMES, 2), bool)
    held, share = soles.hold_flat(points, REST_JOINTS, feet, flat, 3.0)
    assert np.allclose(share, 1.0)
    assert np.ptp(held[:, toes], axis=0).max() < 1e-9


def test_nearness_falls_from_one_to_zero_over_the_ramp() -> None:
    flags = np.zeros(11, bool)
    flags[5] = True
    share = soles.near(flags, 3.0)
    assert share[5] == 1.0
    assert (np.diff(share[5:]) <= 0).all()
    assert share[8:].max() == share[:3].max() == 0.0
