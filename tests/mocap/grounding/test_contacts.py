"""Laws of contacts, of feet that are held, and of the path that keeps them still."""

import numpy as np
import pytest

from robojackson.body import feet as soles
from robojackson.body.forward_kinematics import forward
from robojackson.body.skeleton import REST_JOINTS, keypoint, pair
from robojackson.mocap.grounding import foot_pinning, leg_ik
from robojackson.mocap.grounding.contacts import (
    ContactConfig,
    contacts,
    image_speed,
    ray_speed,
)
from robojackson.motion.smpl_sequence import AIR, PLANTED, SLIDING

FPS = 30.0
FRAMES = 40
GROUNDED = np.zeros(FRAMES, bool)
CONFIG = ContactConfig()


def four_feet(height: float = 0.0, speed: float = 0.0) -> np.ndarray:
    """Return four points at a height that move sideways (y) at a speed."""
    feet = np.zeros((FRAMES, 4, 3))
    feet[..., 2] = height
    feet[..., 1] = (np.arange(FRAMES) / FPS * speed)[:, None]
    return feet


def states(height: float, speed: float, falling: np.ndarray = GROUNDED) -> np.ndarray:
    """Return the states of four points that are all as high and as fast."""
    shape = np.ones((FRAMES, 4))
    return contacts(height * shape, speed * shape, falling, FPS, CONFIG)


def test_still_feet_on_the_floor_are_planted() -> None:
    assert (states(0.0, 0.05) == PLANTED).all()


def test_feet_that_glide_over_the_floor_slide() -> None:
    assert (states(0.0, 1.0) == SLIDING).all()


@pytest.mark.parametrize("speed", [0.0, 2.0])
def test_a_raised_foot_is_in_the_air_still_or_not(speed: float) -> None:
    height, fast = np.zeros((FRAMES, 4)), np.zeros((FRAMES, 4))
    height[:, 2:], fast[:, 2:] = 0.3, speed
    found = contacts(height, fast, GROUNDED, FPS, CONFIG)
    assert (found == [PLANTED, PLANTED, AIR, AIR]).all()


def test_no_one_levitates_outside_free_fall() -> None:
    assert (states(0.4, 0.5) != AIR).any(1).all()


def test_who_must_be_carried_is_carried_by_the_lowest_point() -> None:
    height = np.tile([0.5, 0.4, 0.3, 0.4], (FRAMES, 1))
    found = contacts(height, np.ones((FRAMES, 4)), GROUNDED, FPS, CONFIG)
    assert (found == [AIR, AIR, SLIDING, AIR]).all()


def test_in_free_fall_nothing_has_to_touch() -> None:
    assert (states(0.4, 0.5, ~GROUNDED) == AIR).all()


def test_one_noisy_frame_changes_no_state() -> None:
    speed = np.full((FRAMES, 4), 0.05)
    speed[20] = 0.7
    assert (contacts(np.zeros((FRAMES, 4)), speed, GROUNDED, FPS, CONFIG) == PLANTED).all()


def test_a_step_changes_the_state_where_it_happens() -> None:
    speed = np.where(np.arange(FRAMES) < 20, 0.05, 1.5)[:, None] * np.ones(4)
    found = contacts(np.zeros((FRAMES, 4)), speed, GROUNDED, FPS, CONFIG)
    assert (found[:20] == PLANTED).all()
    assert (found[20:] == SLIDING).all()


def test_speed_in_the_image_is_blind_along_the_ray() -> None:
    points = np.zeros((FRAMES, 4, 3)) + [0.0, 0.0, 3.0]
    points[..., 2] += np.arange(FRAMES)[:, None] / FPS
    assert np.allclose(image_speed(points, FPS), 0.0, atol=1e-9)
    points[..., 1] += 0.5 * np.arange(FRAMES)[:, None] / FPS
    assert image_speed(points, FPS)[0] == pytest.approx(0.5, rel=0.02)


def test_root_correction_undoes_a_drift_that_planted_feet_reveal() -> None:
    feet = four_feet()
    drift = 0.05 * np.arange(FRAMES) / FRAMES
    feet[..., 1] += drift[:, None]
    config = foot_pinning.FootPinningConfig(track=(0.1, 0.3), slip=0.001)
    shift = foot_pinning.root_correction(
        feet, np.ones((FRAMES, 4), bool), np.zeros(FRAMES), FPS, config
    )
    assert np.ptp((feet + shift[:, None])[:, 0, 1]) < 0.1 * drift.max()


@pytest.mark.parametrize("fps", [15.0, 60.0, 120.0])
def test_root_correction_of_another_frame_rate_is_the_same_path(fps: float) -> None:
    """Planted feet drift by 12 cm in a second, in which they are planted for two thirds."""

    def path(fps: float) -> np.ndarray:
        time = np.arange(round(2.0 * fps) + 1) / fps
        feet = np.zeros((len(time), 4, 3))
        feet[..., :2] = 0.12 * np.sin(np.pi * time[:, None, None] / 2.0)
        planted = np.repeat(((time > 0.59) & (time < 1.81))[:, None], 4, axis=1)
        config = foot_pinning.FootPinningConfig()
        shift = foot_pinning.root_correction(feet, planted, np.zeros(len(time)), fps, config)
        seconds = np.linspace(0.0, 2.0, 31)
        return np.stack([np.interp(seconds, time, shift[:, axis]) for axis in range(2)])

    assert np.ptp(path(30.0)) > 0.02
    assert np.abs(path(fps) - path(30.0)).max() < 0.007


def test_root_correction_without_contact_is_nothing() -> None:
    planted = np.zeros((FRAMES, 4), bool)
    shift = foot_pinning.root_correction(
        four_feet(speed=1.0), planted, np.zeros(FRAMES), FPS, foot_pinning.FootPinningConfig()
    )
    assert np.allclose(shift, 0.0)


def test_root_correction_minimises_its_cost() -> None:
    """Against a dense least-squares solution of the same residuals."""
    rng = np.random.default_rng(0)
    feet, slope = rng.normal(scale=0.1, size=(12, 4, 3)), rng.normal(size=12)
    planted = rng.uniform(size=(12, 4)) < 0.7
    config = foot_pinning.FootPinningConfig(track=(0.3, 0.7), slip=0.2, wobble=0.4, leash_m=100.0)
    first, second = (np.diff(np.eye(12), order, axis=0) for order in (1, 2))
    rows, goals = [], []
    for axis in range(2):
        place = np.eye(2)[axis]
        for point in range(4):
            held = (planted[1:, point] & planted[:-1, point]) / config.slip
            rows.append(np.kron(first, place) * held[:, None])
            goals.append(-held * np.diff(feet[:, point, axis]))
        rows.append(np.kron(second, place) / config.wobble)
        goals.append(np.zeros(10))
    rows.append(np.kron(np.eye(12), [1.0, 0.0]) / config.track[1])
    rows.append((np.kron(np.eye(12), [0.0, 1.0]) - np.kron(np.diag(slope), [1.0, 0.0])) / 0.3)
    goals += [np.zeros(12), np.zeros(12)]
    expected = np.linalg.lstsq(np.concatenate(rows), np.concatenate(goals), rcond=None)[0]
    shift = foot_pinning.root_correction(feet, planted, slope, 30.0, config)
    assert np.allclose(shift[:, :2].reshape(-1), expected)


def test_a_person_moved_away_from_the_camera_keeps_the_place_in_the_image() -> None:
    """Feet that drift along the ray pull the body back along it."""
    feet = four_feet()
    drift = 0.2 * (np.arange(FRAMES) / FRAMES)[:, None]
    feet[..., 0] += drift
    feet[..., 1] -= 0.5 * drift
    slope, planted = np.full(FRAMES, -0.5), np.ones((FRAMES, 4), bool)
    shift = foot_pinning.root_correction(
        feet, planted, slope, FPS, foot_pinning.FootPinningConfig()
    )
    assert np.ptp(shift[:, 0]) > 0.1
    assert np.allclose(shift[:, 1], -0.5 * shift[:, 0], atol=2e-3)


def test_pinned_feet_stand_still_on_the_floor() -> None:
    feet = four_feet(height=0.02)
    feet[..., 0] += 0.01 * np.random.default_rng(1).normal(size=(FRAMES, 1))
    moved = feet + np.repeat(
        foot_pinning.pin_offsets(feet, np.ones((FRAMES, 4), bool), 6.0), 2, axis=1
    )
    assert np.ptp(moved, axis=0).max() < 1e-12
    assert np.allclose(moved[..., 2], 0.0)


def test_a_correction_fades_after_the_contact_and_between_two_it_goes_over() -> None:
    selected = np.full((30, 1), np.nan)
    selected[:5], selected[10:12] = 0.1, 0.2
    found = foot_pinning.faded(selected, 6.0)[:, 0]
    assert np.allclose(found[:5], 0.1)
    assert np.allclose(found[10:12], 0.2)
    assert ((found[5:10] > 0.05) & (found[5:10] < 0.25)).all()
    assert (np.diff(found[11:18]) < 0).all()
    assert np.allclose(found[17:], 0.0)


def test_a_lone_toe_in_the_air_is_tipped_down_to_the_floor() -> None:
    points = np.repeat(REST_JOINTS[None][..., [2, 0, 1]], FRAMES, axis=0)
    points[..., 2] -= points[0, pair("ankle")[0], 2] - 0.12
    toe = keypoint("left_big_toe")
    feet = np.zeros((FRAMES, 4, 3))
    feet[:, 1] = points[:, toe]
    planted = np.zeros((FRAMES, 4), bool)
    planted[:, 1] = True
    angles = foot_pinning.tip_angles(points, feet, planted, FPS, 3.0)
    turned = soles.turn_feet(points, angles)
    assert points[0, toe, 2] > 0.03
    assert np.allclose(turned[:, toe, 2], 0.0, atol=2e-3)
    assert np.allclose(angles[:, 1], 0.0)


def test_moving_a_foot_keeps_the_leg_lengths_and_reaches_the_goal() -> None:
    points = np.repeat(REST_JOINTS[None], FRAMES, axis=0)
    hip, knee, ankle = (pair(name)[0] for name in ("hip", "knee", "ankle"))
    points[:, knee, 2] += 0.2
    offsets = np.zeros((FRAMES, 2, 3))
    offsets[:, 0] = [0.05, 0.08, 0.03]
    moved = leg_ik.move_feet(points, offsets)
    for a, b in ((hip, knee), (knee, ankle)):
        before = np.linalg.norm(points[:, a] - points[:, b], axis=-1)
        assert np.allclose(np.linalg.norm(moved[:, a] - moved[:, b], axis=-1), before)
    assert np.allclose(moved[:, ankle], points[:, ankle] + offsets[:, 0])
    assert np.allclose(moved[:, pair("knee")[1]], points[:, pair("knee")[1]])


def test_a_goal_out_of_reach_stretches_the_leg_and_no_more() -> None:
    hip, knee, ankle = np.zeros((1, 3)), np.array([[0.1, 0, -0.4]]), np.array([[0, 0, -0.8]])
    reached = leg_ik.reach(hip, knee, ankle, np.array([[0.0, 0.0, -2.0]]))[1]
    length = 2.0 * np.hypot(0.1, 0.4)
    assert reached[0, 2] == pytest.approx(-length, rel=1e-3)


def test_a_leg_that_is_pulled_straight_never_jerks_its_knee() -> None:
    """A goal that leaves at 1 m/s: without easing the knee's speed has no bound."""
    lengths = np.linspace(0.75, 0.95, 201)
    hip, knee = np.zeros((201, 3)), np.tile([0.1, 0.0, -0.4], (201, 1))
    goal = np.outer(lengths, [0.0, 0.0, -1.0])
    bent = leg_ik.reach(hip, knee, np.tile([0.0, 0.0, -0.8], (201, 1)), goal)[0]
    assert np.linalg.norm(np.diff(bent, axis=0), axis=-1).max() < 6.0 * (lengths[1] - lengths[0])


def test_body_follows_the_height_that_the_standing_feet_share() -> None:
    offsets = np.zeros((FRAMES, 2, 3))
    offsets[:, 0, 2], offsets[:, 1, 2] = 0.01, 0.03
    planted = np.ones((FRAMES, 4), bool)
    assert np.allclose(foot_pinning.shared_height(offsets, planted), [0.0, 0.0, 0.02])
    planted[:, 2:] = False
    assert np.allclose(foot_pinning.shared_height(offsets, planted), [0.0, 0.0, 0.01])


def test_lift_takes_the_lower_end_of_a_foot_to_the_floor() -> None:
    feet = four_feet()
    feet[:, 1, 2] = -0.04
    assert np.allclose(leg_ik.lift_offsets(feet)[:, :, 2], [0.04, 0.0])


def test_sole_of_the_rest_pose_is_flat() -> None:
    local = np.broadcast_to(np.eye(3), (1, 24, 3, 3)).copy()
    upright = np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0]], float)
    local[:, 0] = upright
    pose = forward(local, REST_JOINTS[None], np.zeros((1, 3)))
    assert np.allclose(soles.pitch(soles.foot_points(pose, REST_JOINTS)), 0.0, atol=0.02)


def test_a_foot_on_heel_and_toe_is_flat_however_steep_it_was_seen() -> None:
    feet = np.zeros((1, 4, 3))
    feet[:, 1::2] = [0.15, 0.0, 0.15]
    assert soles.stands_flat(feet, np.array([[True, True, True, False]])).tolist() == [
        [True, False]
    ]


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
    held, share = soles.level_feet(points, REST_JOINTS, feet, flat, 3.0)
    assert np.allclose(share, 1.0)
    assert np.ptp(held[:, toes], axis=0).max() < 1e-9


def test_nearness_falls_from_one_to_zero_over_the_ramp() -> None:
    flags = np.zeros(11, bool)
    flags[5] = True
    share = soles.near(flags, 3.0)
    assert share[5] == 1.0
    assert (np.diff(share[5:]) <= 0).all()
    assert share[8:].max() == share[:3].max() == 0.0


def test_feet_that_come_towards_the_camera_are_not_planted_though_still_in_the_image() -> None:
    still, fast = 0.05 * np.ones((FRAMES, 4)), 3.0 * np.ones((FRAMES, 4))
    assert (contacts(0.0 * still, still, GROUNDED, FPS, CONFIG, along=still) == PLANTED).all()
    assert (contacts(0.0 * still, still, GROUNDED, FPS, CONFIG, along=fast) == SLIDING).all()


def test_speed_along_the_ray_and_speed_in_the_image_are_the_legs_of_the_whole_speed() -> None:
    time = np.arange(FRAMES) / FPS
    points = np.array([-4.0, 0.5, -1.0]) + time[:, None] * [1.2, 0.4, 0.1]
    feet = np.repeat(points[:, None], 4, axis=1)
    whole = np.hypot(ray_speed(feet, FPS), image_speed(feet, FPS))
    assert np.allclose(whole[1:-1], np.linalg.norm([1.2, 0.4, 0.1]), rtol=1e-3)


def test_feet_wrongly_held_cannot_take_the_body_far_from_where_the_camera_saw_it() -> None:
    feet = four_feet()
    feet[..., 0] += np.linspace(-1.0, 1.0, FRAMES)[:, None]
    held, straight = np.ones((FRAMES, 4), bool), np.zeros(FRAMES)

    def furthest(config: foot_pinning.FootPinningConfig) -> float:
        return float(np.abs(foot_pinning.root_correction(feet, held, straight, FPS, config)).max())

    assert furthest(foot_pinning.FootPinningConfig(leash_m=100.0)) > 0.9
    assert furthest(foot_pinning.FootPinningConfig()) < 0.5
