"""Laws of the figures of the mocap benchmark."""

import numpy as np
import pytest

from benchmarks.mocap import figures
from benchmarks.mocap.truth import HELD_OUT, JOINTS, Truth, load_truth
from robojackson.body.skeleton import REST_JOINTS, keypoint
from robojackson.motion.smpl_sequence import AIR, PLANTED, SLIDING, SmplSequence

FPS = 30.0


@pytest.fixture(scope="module")
def walk() -> Truth:
    return load_truth("walk")


def sequence_with(joints: np.ndarray, contact: np.ndarray | None = None) -> SmplSequence:
    """Return a sequence that has the twelve joints of a truth and nothing else of interest."""
    count = len(joints)
    points = np.zeros((count, 29, 3))
    points[:, [keypoint(name) for name in JOINTS]] = joints
    return SmplSequence(
        fps=FPS,
        global_orient=np.zeros((count, 3)),
        body_pose=np.zeros((count, 69)),
        transl=np.zeros((count, 3)),
        joints=points[:, :24],
        keypoints_w=points,
        confidence=np.ones((count, 29)),
        contact=np.full((count, 4), PLANTED) if contact is None else contact,
        valid=np.ones(count, bool),
        betas=np.zeros(10),
        rest_joints=REST_JOINTS,
    )


def test_the_truth_has_no_error_and_its_own_speed(walk: Truth) -> None:
    found = figures.joint_errors(walk.joints, walk, FPS)
    assert found["pa_mpjpe_mm"] == pytest.approx(0.0, abs=1e-6)
    assert found["mpjve_mm_s"] == pytest.approx(0.0, abs=1e-6)
    assert found["speed_ratio"] == pytest.approx(1.0)
    assert found["acceleration_ratio"] == pytest.approx(1.0)


def test_half_the_amplitude_has_half_the_gain_and_jitter_none(walk: Truth) -> None:
    """Noise raises the speed and not the gain along the truth."""
    middle = walk.joints.mean(0)
    half = middle + (walk.joints - middle) / 2.0
    assert figures.joint_errors(half, walk, FPS)["velocity_gain"] == pytest.approx(0.5, abs=0.05)
    assert figures.velocity_score(half, walk)["velocity_score"] == pytest.approx(0.75, abs=0.05)
    shaken = half + np.random.default_rng(0).normal(scale=0.02, size=half.shape)
    found = figures.joint_errors(shaken, walk, FPS)
    assert found["velocity_gain"] < 0.6
    assert found["speed_ratio"] > 1.0


def test_knees_that_stay_straight_are_found(walk: Truth) -> None:
    joints = walk.joints.copy()
    joints[:, 2:4] = (joints[:, 0:2] + joints[:, 4:6]) / 2.0
    found = figures.knee_figures(joints, walk)
    assert found["knee_bias_deg"] < -30.0
    assert found["knee_gain"] == pytest.approx(0.0, abs=1e-6)
    assert figures.knee_figures(walk.joints, walk)["knee_gain"] == pytest.approx(1.0)


def test_frames_around_a_seam_do_not_count(walk: Truth) -> None:
    broken = walk.joints.copy()
    broken[36:42] += np.random.default_rng(0).normal(size=(6, 12, 3))
    assert walk.seams == (39,)
    assert figures.joint_errors(broken, walk, FPS) == pytest.approx(
        figures.joint_errors(walk.joints, walk, FPS), abs=1e-6
    )


def test_a_frozen_pose_has_no_speed(walk: Truth) -> None:
    frozen = np.repeat(walk.joints[:1], len(walk.joints), axis=0)
    found = figures.joint_errors(frozen, walk, FPS)
    assert found["speed_ratio"] == pytest.approx(0.0)
    assert found["rr_mpjpe_mm"] > 50.0


def test_the_path_may_be_turned_shifted_and_scaled_but_not_tilted(walk: Truth) -> None:
    angle = 0.7
    turn = np.array(
        [[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]]
    )
    moved = 0.8 * walk.joints @ turn.T + [3.0, -2.0, 0.1]
    found = figures.path_error_share(sequence_with(moved), walk)
    assert found["path_error"] == pytest.approx(0.0, abs=1e-6)
    assert found["path_scale"] == pytest.approx(1.0 / 0.8)
    tilted = walk.joints @ turn[[2, 0, 1]][:, [2, 0, 1]].T
    assert figures.path_error_share(sequence_with(tilted), walk)["path_error"] > 0.03


@pytest.mark.parametrize("clip", ["dance_b", *HELD_OUT])
def test_in_the_truths_contacts_no_body_levitates(clip: str) -> None:
    feet = load_truth(clip).feet
    assert feet is not None
    assert (figures.true_contacts(feet, FPS) != AIR).any(1).all()


def test_a_true_foot_is_planted_while_it_stands_still_whatever_the_floor_does() -> None:
    feet = np.zeros((60, 4, 3))
    feet[..., 2] = 0.1 * np.sin(np.arange(60) / 20.0)[:, None]
    assert (figures.true_contacts(feet, FPS) == PLANTED).all()
    feet[30:, 2:, 1] += 0.05 * np.arange(30)[:, None]
    assert (figures.true_contacts(feet, FPS)[35:55, 2:] == SLIDING).all()


def test_hanging_in_the_air_is_unsupported_and_falling_is_not(walk: Truth) -> None:
    airborne = np.full((len(walk.joints), 4), AIR)
    hanging = sequence_with(np.repeat(walk.joints[:1], len(walk.joints), axis=0), airborne)
    assert figures.unsupported_share(hanging) == 1.0
    drop = 4.905 * (np.arange(len(walk.joints)) / FPS) ** 2
    falling = walk.joints[:1] - drop[:, None, None] * [0.0, 0.0, 1.0]
    sequence = sequence_with(falling, airborne)
    # keypoints that are not of the twelve joints stay where they are, the centre of mass lags
    assert figures.unsupported_share(sequence) < 0.1


def test_hysteresis_changes_only_beyond_both_thresholds() -> None:
    values = np.array([0.0, 0.6, 0.9, 1.1, 0.9, 0.6, 0.4, 0.9])
    expected = [True, True, True, False, False, False, True, True]
    assert figures.hysteresis(values, on=0.5, off=1.0).tolist() == expected


def test_short_runs_join_the_state_before() -> None:
    states = np.array([1, 1, 0, 1, 1, 1, 0, 0, 0], bool)
    assert figures.join_short(states, 2).tolist() == [1, 1, 1, 1, 1, 1, 0, 0, 0]


def test_f1_is_the_harmonic_mean_of_precision_and_recall() -> None:
    found, true = np.array([1, 1, 1, 0, 0], bool), np.array([1, 1, 0, 1, 0], bool)
    precision, recall = 2 / 3, 2 / 3
    expected = 2 * precision * recall / (precision + recall)
    assert figures.f1(found, true) == pytest.approx(expected)
