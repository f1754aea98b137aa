"""A programme: each part begins where the one before ends, and the ways can be done."""

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from robojackson.errors import RejectedReference
from robojackson.geometry.rotations import heading
from robojackson.retarget.performance import programme
from robojackson.retarget.performance.programme import (
    STAND,
    WAY,
    Part,
    Programme,
    ProgrammeConfig,
    plan,
    stand_of,
)
from robojackson.retarget.performance.ways import way
from robojackson.retarget.retarget_config import RetargetConfig
from robojackson.robot.model import Robot
from robojackson.robot.tree_kinematics import pose, tree
from tests.fixtures.robots import robot_motion, stock

QUICK = RetargetConfig()
SHORT = ProgrammeConfig(dance_s=1.0, stand_s=0.3)


@lru_cache
def twice() -> Programme:
    """Return the hip-shake two times, the second one turned and elsewhere in its file."""
    dance = robot_motion("hip_shake")
    return plan([("first", dance), ("second", dance)], stock(), SHORT, QUICK)


@pytest.mark.slow
def test_the_parts_follow_each_other_without_a_gap() -> None:
    parts = twice().parts
    assert [part.name for part in parts] == [STAND, WAY, "first", WAY, "second", WAY, STAND]
    assert [part.start for part in parts[1:]] == [part.end for part in parts[:-1]]
    assert parts[-1].end == len(twice().motion)
    assert [part.name for part in parts if part.is_dance] == ["first", "second"]


@pytest.mark.slow
def test_nothing_jumps_where_two_parts_meet() -> None:
    motion, bound = twice().motion, stock().description.max_joint_speed
    qpos = np.asarray(motion.qpos)
    assert np.abs(np.diff(qpos[:, 7:], axis=0)).max() / motion.dt < bound
    meets = [part.start for part in twice().parts[1:]]
    steps = np.linalg.norm(np.diff(qpos[:, :3], axis=0), axis=1)[np.array(meets) - 1]
    assert steps.max() < 0.005
    assert np.abs(qpos[0] - stand_of(stock())).max() == 0.0
    np.testing.assert_allclose(qpos[-1, 7:], stand_of(stock())[7:], atol=1e-9)


@pytest.mark.slow
def test_a_dance_is_the_same_wherever_it_is_danced() -> None:
    first, second = (part for part in twice().parts if part.is_dance)
    qpos = np.asarray(twice().motion.qpos)
    hinges = [qpos[part.start : part.end, 7:] for part in (first, second)]
    np.testing.assert_allclose(*hinges, atol=1e-9)


@pytest.mark.slow
def test_a_way_ends_exactly_in_the_stand_that_it_leads_to(robot: Robot) -> None:
    start, end = stand_of(robot), stand_of(robot)
    end[7:] += 0.05 * np.random.default_rng(0).uniform(-1, 1, len(end) - 7)
    found = way(start, end, robot, QUICK, 0.015)
    np.testing.assert_allclose(found.qpos[[0, -1]], [start, end], atol=1e-9)


@pytest.mark.slow
def test_feet_that_stand_elsewhere_are_lifted_there(robot: Robot) -> None:
    start, end = stand_of(robot), stand_of(robot)
    end[:2] = [0.15, 0.0]
    found = way(start, end, robot, QUICK, 0.015)
    feet = [robot.keypoint_names.index(f"{side}_foot") for side in ("left", "right")]
    heights = pose(tree(robot), found.qpos).site_pos[:, feet, 2]
    assert (np.ptp(heights, axis=0) > 0.01).all()
    assert (found.contact == 0).any(axis=0).all()
    assert abs(float(heading(found.qpos[-1, 3:7]))) < 1e-9


def test_no_dance_is_no_performance(robot: Robot) -> None:
    with pytest.raises(RejectedReference, match="at least one dance"):
        plan([], robot, SHORT, QUICK)


def test_a_way_that_cannot_be_done_is_refused_by_the_names_of_its_ends() -> None:
    parts = [Part("a", 0, 10, (0, 10), 0.0), Part(WAY, 10, 20, (10, 10), 0.2)]
    parts.append(replace(parts[0], name="b", start=20, end=30))
    with pytest.raises(RejectedReference, match="way from a to b is infeasible for 20 %"):
        programme._require_ways(parts, 0.015)
