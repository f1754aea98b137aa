"""Laws of the twist cues: a bent limb shows its twist, a straight one takes the prior."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from robojackson.body.analytic_solve import solve_with
from robojackson.body.forward_kinematics import forward, split
from robojackson.body.skeleton import AIM_CHILD, JOINT_NAMES, REST_JOINTS, keypoint
from robojackson.mocap.pose import twist
from robojackson.mocap.pose.keypoints import LEFT


def solved_twist(joint: str, cue: twist.Cue, local: np.ndarray) -> np.ndarray:
    """Return the twist angle of one joint after a solve with one cue, radians."""
    points = forward(local, REST_JOINTS[None], np.zeros((len(local), 3))).points
    found = solve_with(points, REST_JOINTS[None], twist.rule({joint: cue}, REST_JOINTS))
    index = keypoint(joint)
    bone = REST_JOINTS[AIM_CHILD[index]] - REST_JOINTS[index]
    cos_sin = split(found[:, index], bone)[1]
    return np.arctan2(cos_sin[:, 1], cos_sin[:, 0])


def bent_arm(turn_deg: float, flexion_deg: float) -> np.ndarray:
    """Return a left arm turned about its own axis and bent at the elbow; all else at rest."""
    local = np.broadcast_to(np.eye(3), (1, 24, 3, 3)).copy()
    local[0, 16] = Rotation.from_euler("x", turn_deg, degrees=True).as_matrix()
    local[0, 18] = Rotation.from_euler("y", -flexion_deg, degrees=True).as_matrix()
    return local


def forearm_cue(local: np.ndarray, weight: float = 1.0) -> twist.Cue:
    points = forward(local, REST_JOINTS[None], np.zeros((1, 3))).points
    return twist.Cue(twist.FORWARD, points[:, 20] - points[:, 18], np.array([weight]))


@pytest.mark.parametrize("turn_deg", [-70.0, -20.0, 0.0, 35.0, 90.0])
def test_a_bent_elbow_shows_how_the_upper_arm_is_turned(turn_deg: float) -> None:
    local = bent_arm(turn_deg, 80.0)
    angle = solved_twist("left_shoulder", forearm_cue(local), local)
    assert np.degrees(angle[0]) == pytest.approx(turn_deg, abs=1e-6)


def test_a_cue_without_weight_leaves_the_prior() -> None:
    local = bent_arm(60.0, 80.0)
    angle = solved_twist("left_shoulder", forearm_cue(local, 0.0), local)
    assert np.degrees(angle[0]) == pytest.approx(twist.PRIOR_DEG["left_shoulder"])


def test_hinges_count_more_the_more_they_are_bent() -> None:
    thigh = np.broadcast_to([0.0, -1.0, 0.0], (4, 3))
    angles = np.radians([5.0, 20.0, 30.0, 60.0])
    shin = np.stack([0 * angles, -np.cos(angles), -np.sin(angles)], -1)
    weight = twist._bent(thigh, shin)
    assert weight[0] == 0.0
    assert weight[3] == 1.0
    assert (np.diff(weight) > 0).all()


def test_twist_stays_inside_its_limit() -> None:
    local = bent_arm(0.0, 80.0)
    cue = twist.Cue(twist.FORWARD, np.array([[0.0, -0.6, -0.8]]), np.ones(1))
    angle = np.degrees(solved_twist("left_shoulder", cue, local)[0])
    limit = twist.LIMIT_DEG["shoulder"]
    assert abs(angle - twist.PRIOR_DEG["left_shoulder"]) <= limit + 1e-9


def test_a_cue_turning_all_the_way_round_never_jumps() -> None:
    around = np.radians(np.arange(0.0, 360.0, 0.5))
    seen = np.stack([0 * around, np.sin(around), np.cos(around)], -1)
    local = np.repeat(bent_arm(0.0, 80.0), len(around), axis=0)
    angle = solved_twist("left_shoulder", twist.Cue(twist.FORWARD, seen, np.ones(720)), local)
    assert np.abs(np.diff(np.unwrap(angle))).max() < np.radians(3.0)


def test_priors_belong_to_joints_that_exist() -> None:
    assert set(twist.PRIOR_DEG) <= set(JOINT_NAMES)
    assert twist.prior().shape == (23, 2)


def test_level_ground_replaces_the_measured_sole() -> None:
    found = {
        f"{side}_ankle": twist.Cue(twist.UP, np.tile(LEFT, (3, 1)), np.full(3, 0.5))
        for side in ("left", "right")
    }
    share = np.array([[0.0, 1.0], [0.5, 1.0], [1.0, 1.0]])
    changed = twist.level_cues(found, share)
    assert np.allclose(changed["right_ankle"].measured, [0.0, 0.0, 1.0])
    assert np.allclose(changed["left_ankle"].weight, [0.5, 0.75, 1.0])
    assert np.allclose(changed["left_ankle"].measured[0], LEFT)
