"""Laps are found where a motion repeats, closed exactly, and not invented elsewhere."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from robojackson.body.skeleton import KEYPOINT_NAMES, REST_JOINTS
from robojackson.errors import TrackTooShort
from robojackson.geometry.frames import SMPL_TO_WORLD
from robojackson.motion.smpl_sequence import SmplSequence
from robojackson.retarget.targets.cycle import CycleConfig, close, find_cycle, heading, human_clip
from tests.fixtures.robots import human

CONFIG = CycleConfig()
STRICT = CycleConfig(least_share=0.95)
"""Nearly the whole clip or nothing: no shorter cycle inside it is looked for."""


def _swaying(frames: int, period: int, drift: float = 0.0, yaw: float = 0.0) -> SmplSequence:
    """Return a body that sways with a known period, drifts along x and turns about z."""
    base = human("hip_shake")
    time = np.arange(frames)
    points = np.repeat(base.keypoints_w[:1], frames, axis=0).copy()
    for index in range(29):
        points[:, index, 1] += 0.06 * points[:, index, 2] * np.sin(2 * np.pi * time / period)
        points[:, index, 2] += 0.02 * np.cos(2 * np.pi * time / period)
    cosine, sine = np.cos(yaw * time)[:, None], np.sin(yaw * time)[:, None]
    x, y = points[..., 0], points[..., 1]
    points[..., 0], points[..., 1] = cosine * x - sine * y, sine * x + cosine * y
    points[..., 0] += drift * time[:, None]
    return replace(
        base,
        keypoints_w=points,
        global_orient=np.zeros((frames, 3)),
        contact=np.ones((frames, 4), int),
        valid=np.ones(frames, bool),
    )


def test_a_whole_number_of_periods_is_kept():
    cycle = find_cycle(_swaying(100, 30), CONFIG)
    assert cycle is not None
    assert (cycle.end - cycle.start) % 30 in (0, 1, 2, 28, 29)
    assert cycle.seam_m < 0.02


def test_a_clip_of_exactly_one_period_is_kept_whole():
    _, cycle = human_clip(_swaying(60, 60), 0.015, "auto", 1.0, CONFIG)
    assert cycle is not None
    assert cycle.end - cycle.start == 60


def test_one_step_of_a_walk_is_not_cyclic():
    walk = human("walk")
    step = replace(
        walk,
        **{k: getattr(walk, k)[:22] for k in ("keypoints_w", "global_orient", "contact", "valid")},
    )
    clip, cycle = human_clip(step, 0.015, "auto", 1.0, CycleConfig(least_share=0.8))
    assert cycle is None
    assert clip.cycle_offset is None


def test_cyclic_no_keeps_the_whole_clip():
    clip, _ = human_clip(_swaying(60, 60), 0.015, "no", 1.0, CONFIG)
    assert clip.cycle_offset is None
    assert clip.time_s[-1] == pytest.approx(59 / 30, abs=0.03)


def test_a_body_that_turns_away_is_not_cyclic():
    _, cycle = human_clip(_swaying(60, 30, yaw=np.pi / 60), 0.015, "auto", 1.0, CONFIG)
    assert cycle is None


def test_a_dancer_who_turns_on_with_every_cycle_is_closed_on_request():
    clip, cycle = human_clip(_swaying(60, 30, yaw=np.pi / 60), 0.015, "yes", 1.0, CONFIG)
    assert cycle is not None
    assert clip.cycle_offset is not None


def _with_an_arm_that_rises(degrees: float) -> SmplSequence:
    """Return a sway of whole periods through which the left forearm turns by an angle."""
    base = _swaying(60, 30)
    elbow, wrist = (KEYPOINT_NAMES.index(f"left_{name}") for name in ("elbow", "wrist"))
    points = base.keypoints_w.copy()
    angle = np.radians(degrees) * np.linspace(0, 1, 60)
    arm = points[:, wrist] - points[:, elbow]
    turn = Rotation.from_rotvec(np.outer(angle, [1.0, 0.0, 0.0]))
    points[:, wrist] = points[:, elbow] + turn.apply(arm)
    return replace(base, keypoints_w=points)


@pytest.mark.parametrize("degrees", [54.0, 108.0])
def test_a_limb_that_does_not_come_back_makes_no_cycle(degrees: float):
    """APT1 and APT2 of the paper: such a jump was once looped and trained on."""
    clip, cycle = human_clip(_with_an_arm_that_rises(degrees), 0.015, "auto", 1.0, STRICT)
    assert (clip.cycle_offset, cycle) == (None, None)


def test_a_limb_that_nearly_comes_back_is_closed():
    clip, cycle = human_clip(_with_an_arm_that_rises(8.0), 0.015, "auto", 1.0, STRICT)
    assert cycle is not None
    elbow, wrist = (KEYPOINT_NAMES.index(f"left_{name}") for name in ("elbow", "wrist"))
    arm = clip.keypoints_w[:, wrist] - clip.keypoints_w[:, elbow]
    step = np.linalg.norm(np.diff(arm, axis=0), axis=1)
    seam = np.linalg.norm(arm[0] - arm[-1])
    assert seam <= 2.0 * step.max()


def test_a_slow_drift_is_closed_on_the_spot_and_travel_is_kept():
    still, _ = human_clip(_swaying(60, 30, drift=0.001), 0.015, "auto", 1.0, CONFIG)
    going, cycle = human_clip(_swaying(60, 30, drift=0.02), 0.015, "auto", 1.0, CONFIG)
    assert still.cycle_offset is not None
    assert cycle is not None
    np.testing.assert_array_equal(still.cycle_offset, 0.0)
    assert going.cycle_offset is not None
    assert going.cycle_offset[0] == pytest.approx(0.02 * (cycle.end - cycle.start), rel=0.02)


def test_closing_joins_pose_and_heading(rng: np.random.Generator):
    points = _swaying(50, 37, yaw=0.004).keypoints_w
    closed, travel = close(points, 0.5)
    np.testing.assert_allclose(closed[-1], closed[0] + travel, atol=1e-9)
    assert heading(closed)[-1] == pytest.approx(heading(closed)[0], abs=1e-9)


def test_tempo_stretches_the_robots_clock():
    whole, _ = human_clip(_swaying(60, 30), 0.015, "no", 1.0, CONFIG)
    slow, _ = human_clip(_swaying(60, 30), 0.015, "no", 0.5, CONFIG)
    assert len(slow.time_s) == pytest.approx(2 * len(whole.time_s), abs=2)
    assert slow.time_s[-1] == pytest.approx(whole.time_s[-1], abs=0.03)


def test_too_short_a_clip_is_refused():
    with pytest.raises(TrackTooShort, match="too short to retarget"):
        human_clip(_swaying(3, 30), 0.015, "auto", 1.0, CONFIG)


@pytest.mark.parametrize("degrees", [0.0, 18.0, 60.0])
def test_a_foot_that_stands_on_an_arc_stands_in_the_closed_cycle(degrees: float) -> None:
    """The heading is closed by turning the body back; its path turns with it."""
    fps, frames, ankle = 50.0, 101, KEYPOINT_NAMES.index("left_ankle")
    rest = (REST_JOINTS - REST_JOINTS[0]) @ SMPL_TO_WORLD.T
    angle = np.radians(degrees) * np.linspace(0.0, 1.0, frames)
    turns = Rotation.from_euler("z", angle[:, None]).as_matrix()
    between = turns[:-1] @ Rotation.from_euler("z", angle[1] / 2).as_matrix()
    path = np.cumsum([[0.0, 0.0, 0.9], *(between @ [1.2 / fps, 0.0, 0.0])], axis=0)
    points = path[:, None] + np.einsum("nij,kj->nki", turns, rest)
    points[80:, ankle] = points[90, ankle]  # it stands as the body passes over it
    back = turns[-1].T @ (points[-1, ankle] - path[-1])
    points[:21, ankle] = path[:21] + back  # and is where it was as the cycle begins: no seam
    closed, travel = close(points, 0.3)
    speed = np.linalg.norm(np.diff(closed[80:, ankle, :2], axis=0), axis=1) * fps
    assert speed.max() < 0.18 * degrees / 60 + 0.01  # .41 and 1.28 m/s with a path that stays
    assert np.degrees(np.arctan2(travel[1], travel[0])) == pytest.approx(0.0, abs=0.1)
