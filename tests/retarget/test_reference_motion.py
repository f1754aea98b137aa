"""The whole stage on our own mocap of two bundled clips."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from robojackson.motion.smpl_sequence import PLANTED
from robojackson.retarget.retarget_config import RetargetConfig
from robojackson.retarget.retargeting import retarget_motion
from robojackson.retarget.scorecard import score
from robojackson.retarget.scorecard_gate import check, failures
from robojackson.retarget.targets.human_clip import at_steps, labels_at
from robojackson.retarget.targets.keypoint_targets import Targets
from robojackson.robot.model import Robot
from robojackson.robot.names import HIPS
from robojackson.robot.resampling import seam_angle
from tests.fixtures.robots import human, robot_motion, stock

CLIPS = ("hip_shake", "walk")


@pytest.mark.parametrize("clip", CLIPS)
def test_no_hinge_ever_leaves_its_limits(clip: str, robot: Robot):
    hinges = robot_motion(clip).qpos[:, 7:]
    limits = robot.model.jnt_range[1:]
    assert (hinges >= limits[:, 0]).all()
    assert (hinges <= limits[:, 1]).all()


@pytest.mark.parametrize("clip", CLIPS)
def test_the_hard_bars_hold(clip: str):
    assert failures(robot_motion(clip).scorecard) == []
    check(robot_motion(clip).scorecard)


@pytest.mark.parametrize("clip", CLIPS)
def test_mujoco_finds_no_deep_contact_in_any_step(clip: str, robot: Robot):
    data, deepest = mujoco.MjData(robot.model), 0.0
    for qpos in robot_motion(clip).qpos:
        data.qpos[:] = qpos
        mujoco.mj_forward(robot.model, data)
        deepest = max(deepest, -float(data.contact.dist.min(initial=0.0)))
    assert deepest <= 0.005


@pytest.mark.parametrize("clip", CLIPS)
def test_keypoints_and_bodies_are_the_forward_kinematics_of_qpos(clip: str, robot: Robot):
    motion, data = robot_motion(clip), mujoco.MjData(robot.model)
    for step in range(0, len(motion), 17):
        data.qpos[:] = motion.qpos[step]
        mujoco.mj_kinematics(robot.model, data)
        for column, name in enumerate(motion.keypoint_names):
            site = data.site(name).xpos
            np.testing.assert_allclose(motion.keypoints_w[step, column], site, atol=1e-9)
        for column, name in enumerate(motion.body_names):
            body = data.body(name).xpos
            np.testing.assert_allclose(motion.body_pos_w[step, column], body, atol=1e-9)


@pytest.mark.parametrize("clip", CLIPS)
def test_the_cycle_closes_in_pose_and_velocity(clip: str):
    motion = robot_motion(clip)
    assert motion.cyclic
    assert seam_angle(motion.qpos, motion.dt, motion.cycle_offset) < 5.0
    over = np.abs(motion.qvel[0, 6:] - motion.qvel[-1, 6:]).max()
    inside = np.abs(np.diff(motion.qvel[:, 6:], axis=0)).max()
    assert over <= 1.5 * inside


def test_the_dance_stays_on_the_spot_and_the_walk_walks():
    np.testing.assert_array_equal(robot_motion("hip_shake").cycle_offset, 0.0)
    travel = robot_motion("walk").cycle_offset
    assert np.linalg.norm(travel) > 0.8
    assert travel[2] == 0.0


def test_planted_soles_of_the_dance_touch_the_floor_within_2_mm(robot: Robot):
    motion = robot_motion("hip_shake")
    soles = motion.keypoints_w[:, robot.contact_keypoints, 2] - robot.contact_radii
    assert np.abs(soles[motion.contact == PLANTED]).max() < 0.002


def test_velocities_lead_from_step_to_step(robot: Robot):
    motion = robot_motion("hip_shake")
    ahead = motion.qpos[10].copy()
    mujoco.mj_integratePos(robot.model, ahead, motion.qvel[10], motion.dt)
    np.testing.assert_allclose(ahead, motion.qpos[11], atol=5e-3)


@pytest.mark.medium
def test_the_same_clip_gives_the_same_motion(robot: Robot):
    again = retarget_motion(human("hip_shake"), robot, RetargetConfig())
    np.testing.assert_array_equal(again.qpos, robot_motion("hip_shake").qpos)
    assert dict(again.scorecard) == dict(robot_motion("hip_shake").scorecard)


@pytest.mark.medium
def test_moving_the_recording_moves_the_motion_and_nothing_else(robot: Robot):
    source = human("hip_shake")
    moved = replace(source, keypoints_w=source.keypoints_w + [1.0, -2.0, 0.0])
    motion = retarget_motion(moved, robot, RetargetConfig())
    expected = robot_motion("hip_shake")
    np.testing.assert_allclose(motion.qpos[:, 7:], expected.qpos[:, 7:], atol=0.02)
    shift = motion.qpos[:, :2] - expected.qpos[:, :2]
    assert np.ptp(shift, axis=0).max() < 0.01


@pytest.mark.medium
def test_noise_on_the_keypoints_does_not_break_the_bars(robot: Robot):
    source, rng = human("hip_shake"), np.random.default_rng(11)
    noisy = source.keypoints_w + 0.015 * rng.normal(size=source.keypoints_w.shape)
    motion = retarget_motion(replace(source, keypoints_w=noisy), robot, RetargetConfig())
    assert failures(motion.scorecard) == []


@pytest.mark.parametrize("method", ["paper", "framefix"])
@pytest.mark.parametrize("clip", CLIPS)
def test_the_papers_mapping_is_at_least_five_times_worse(clip: str, method: str):
    ours, theirs = robot_motion(clip).scorecard, robot_motion(clip, method).scorecard
    assert theirs["keypoint_leaned_mm"] > 5 * ours["keypoint_leaned_mm"]
    assert theirs["keypoint_mm"] > 2 * ours["keypoint_mm"]
    assert theirs["planted_slip_cm_s"] > 5 * ours["planted_slip_cm_s"]


def test_fidelity_is_reported_against_the_dancer_and_not_against_what_was_leaned():
    """The hip shake is leaned over the ball feet; the card must not hide what that costs."""
    card = robot_motion("hip_shake").scorecard
    head_mm = 1e3 * 1.5 * np.tan(np.radians(card["lean_deg"]))
    assert card["lean_deg"] > 1
    assert 0.3 * head_mm < card["keypoint_mm"] < head_mm
    assert card["keypoint_leaned_mm"] < card["keypoint_pelvis_mm"] < card["keypoint_mm"]


@pytest.mark.parametrize("apart_m", [0.0, 0.05])
def test_the_error_from_the_pelvis_is_one_of_the_pose_wherever_its_keypoint_is(apart_m: float):
    """The target of the pelvis is the middle of the hips, 3 cm below the G1's keypoint."""
    robot, motion = stock(), robot_motion("hip_shake")
    points, hips = motion.keypoints_w, [1, 2]
    assert [motion.keypoint_names[column] for column in (0, *hips)] == ["pelvis", *HIPS]
    own = np.einsum("k,tkx->tx", [0.5, 0.5], points[:, hips])[:, None]
    aims = Targets(
        keypoints_w=own + 0.9 * (points - own) + [1.0, 2.0, 3.0],
        weights=np.ones(points.shape[:2]),
        contact=motion.contact,
        heading=np.repeat(np.eye(3)[None], len(motion), 0),
        dt=motion.dt,
        cycle_offset=motion.cycle_offset,
        airborne=np.zeros(len(motion), bool),
    )
    moved = points.copy()
    moved[:, 0, 2] += apart_m
    weighted = robot.keypoint_weights > 0
    assert not weighted[0]
    far = np.sqrt(np.sum((points - own)[:, weighted] ** 2, -1))
    card = score(replace(motion, keypoints_w=moved), robot, aims)
    assert card["keypoint_pelvis_mm"] == pytest.approx(1e3 * 0.1 * far.mean(), rel=1e-9)


def test_the_literal_mapping_breaks_joint_limits_and_the_metric_sees_it():
    hinges = robot_motion("walk", "paper").qpos[:, 7:]
    outside = (hinges < stock().lower - 1e-9) | (hinges > stock().upper + 1e-9)
    assert robot_motion("walk", "paper").scorecard["limit_violations"] == outside.sum() > 100


@pytest.mark.medium
def test_a_slower_tempo_needs_less_torque(robot: Robot):
    slow = robot_motion("walk")
    fast = retarget_motion(human("walk"), robot, RetargetConfig(tempo=1.5))
    assert slow.scorecard["torque_ratio_p95"] < 0.95 * fast.scorecard["torque_ratio_p95"]
    assert slow.scorecard["seconds"] == pytest.approx(1.5 * fast.scorecard["seconds"], rel=0.05)


@pytest.mark.medium
def test_the_frame_rate_of_the_source_hardly_matters(robot: Robot):
    source = human("hip_shake")
    times = np.arange(0, len(source) - 1 + 1e-9, 0.5) / source.fps
    double = replace(
        source,
        fps=2 * source.fps,
        keypoints_w=at_steps(source.keypoints_w, source.fps, times),
        contact=labels_at(source.contact, source.fps, times),
        valid=labels_at(source.valid, source.fps, times),
        global_orient=np.zeros((len(times), 3)),
        body_pose=np.zeros((len(times), 69)),
    )
    config = RetargetConfig(cyclic="no")
    twice, once = retarget_motion(double, robot, config), retarget_motion(source, robot, config)
    steps = min(len(twice), len(once))
    gap = np.abs(twice.qpos[:steps, 7:] - once.qpos[:steps, 7:])
    assert np.degrees(np.quantile(gap, 0.99)) < 2.0


@pytest.mark.medium
def test_every_second_frame_undetected_is_survived(robot: Robot):
    source = human("hip_shake")
    valid = source.valid.copy()
    valid[::2] = False
    assert (
        failures(retarget_motion(replace(source, valid=valid), robot, RetargetConfig()).scorecard)
        == []
    )
