"""A motion that does not repeat begins and ends standing, with the feet where the clip has them."""

from dataclasses import replace

import numpy as np
import pytest

from robojackson.motion.smpl_sequence import AIR, PLANTED
from robojackson.retarget.retarget_config import RetargetConfig
from robojackson.retarget.retargeting import retarget_motion
from robojackson.retarget.targets.cycle import CycleConfig, human_clip
from robojackson.retarget.targets.keypoint_targets import Targets, targets
from robojackson.retarget.targets.tails import TailConfig, with_tails
from robojackson.robot.description import FallRule
from robojackson.robot.model import Robot, load_robot
from tests.fixtures.robots import human, stock

TAILS = TailConfig(use="yes", lead_s=0.3, blend_s=0.6, stand_s=0.9, steps=False)
FEET = ("left_foot", "right_foot")


@pytest.fixture(scope="module")
def aims() -> Targets:
    robot = stock()
    dt = robot.description.control_dt
    clip, _ = human_clip(human("dance_b"), dt, "no", 1.0, CycleConfig())
    return targets(clip, robot)


def columns(robot: Robot, names: tuple[str, ...]) -> list[int]:
    return [robot.keypoint_names.index(name) for name in names]


def test_the_clip_itself_is_untouched(robot: Robot, aims: Targets) -> None:
    tailed = with_tails(aims, robot, TAILS)
    np.testing.assert_array_equal(tailed.aims.keypoints_w[tailed.clip], aims.keypoints_w)
    np.testing.assert_array_equal(tailed.aims.contact[tailed.clip], aims.contact)
    seconds = (len(tailed.aims) - len(aims)) * aims.dt
    assert seconds == pytest.approx(0.3 + 0.6 + 0.6 + 0.9, abs=0.05)


def test_it_ends_upright_on_both_feet_at_rest(robot: Robot, aims: Targets) -> None:
    found = with_tails(aims, robot, TAILS).aims
    for end in (found.keypoints_w[-20:], found.keypoints_w[:15]):
        assert np.ptp(end, axis=0).max() < 1e-12
    assert (found.contact[[0, -1]] == PLANTED).all()
    head, pelvis = (robot.keypoint_names.index(name) for name in ("head", "pelvis"))
    for step in (0, -1):
        trunk = found.keypoints_w[step, head] - found.keypoints_w[step, pelvis]
        assert trunk[2] > 0.95 * np.linalg.norm(trunk)


def test_nothing_jumps_where_the_tail_begins(robot: Robot, aims: Targets) -> None:
    tailed = with_tails(aims, robot, TAILS)
    steps = np.linalg.norm(np.diff(tailed.aims.keypoints_w, axis=0), axis=-1)
    inside = steps[tailed.clip][:-1].max()
    for seam in (tailed.clip.start - 1, tailed.clip.stop - 1):
        assert steps[seam].max() <= 1.5 * inside


def test_the_feet_stay_where_the_clip_leaves_them(robot: Robot, aims: Targets) -> None:
    found = with_tails(aims, robot, TAILS)
    feet = columns(robot, FEET)
    after = found.aims.keypoints_w[found.clip.stop - 1 :, feet, :2]
    np.testing.assert_allclose(after, after[:1].repeat(len(after), 0), atol=1e-12)


def test_a_foot_in_the_air_is_put_down(robot: Robot, aims: Targets) -> None:
    lifted = aims.keypoints_w.copy()
    foot = robot.keypoint_names.index("left_foot")
    lifted[-1, foot, 2] += 0.3
    contact = aims.contact.copy()
    contact[-1, robot.contact_keypoints == foot] = AIR
    found = with_tails(replace(aims, keypoints_w=lifted, contact=contact), robot, TAILS)
    heights = found.aims.keypoints_w[found.clip.stop :, foot, 2]
    assert heights[-1] < lifted[-1, foot, 2] - 0.2
    assert (np.diff(heights) <= 1e-12).all()
    states = found.aims.contact[found.clip.stop :, robot.contact_keypoints == foot]
    assert states[0, 0] == AIR
    assert states[-1, 0] == PLANTED


def test_a_cycle_gets_none(robot: Robot, aims: Targets) -> None:
    cycle = replace(aims, cycle_offset=np.zeros(3))
    assert with_tails(cycle, robot, TAILS).aims is cycle


def test_by_itself_a_robot_that_is_evaluated_beside_the_reference_gets_them(robot: Robot) -> None:
    other = load_robot(replace(robot.description, fall=FallRule(frame="reference", height=0.25)))
    assert TailConfig().applies_to(other)
    assert not TailConfig().applies_to(robot)


def test_a_retargeted_motion_stands_at_its_end(robot: Robot) -> None:
    """The last second hardly moves; the card's shares are the clip's."""
    short = TailConfig(use="yes", lead_s=0.1, blend_s=0.6, stand_s=1.0, steps=False)
    config = RetargetConfig(cyclic="no", tails=short)
    config = replace(config, repair=replace(config.repair, weights=()))
    motion = retarget_motion(human("dance_b"), robot, config)
    last = motion.qpos[-int(0.6 / motion.dt) :]
    assert np.ptp(last[:, 7:], axis=0).max() < 1e-9
    assert motion.scorecard["tail_s"] == pytest.approx(1.6, abs=0.05)
    assert motion.source_time_s[-1] == motion.source_time_s[-10]
    assert motion.certificate is not None
    share = float((motion.certificate.slack > 1.0).mean())
    assert motion.scorecard["infeasible_share"] > share
