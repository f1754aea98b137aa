"""Steps from feet on which no robot stands well into the robot's own stand."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from robojackson.motion.smpl_sequence import AIR, PLANTED
from robojackson.retarget.targets.cycle import CycleConfig, human_clip
from robojackson.retarget.targets.footsteps import (
    CLEARANCE_M,
    SIDES,
    Feet,
    Placement,
    about_up,
    feet_of,
    own_stand,
    place_feet,
    stand_feet,
    stand_over,
    stands_badly,
    steps_into_stand,
)
from robojackson.retarget.targets.keypoint_targets import targets
from robojackson.retarget.targets.tails import TailConfig, with_tails
from robojackson.robot.model import Robot, load_robot
from tests.fixtures import machine
from tests.fixtures.robots import human

HEADING, DT = 0.7, 0.02


def own_feet(robot: Robot) -> Feet:
    middle = np.array([1.0, -2.0])
    return stand_feet({side: Placement(middle, 0.0) for side in SIDES}, HEADING, robot)


def exchanged(robot: Robot) -> Feet:
    """Return crossed legs: each foot where the other belongs, the right one in front."""
    own = own_feet(robot)
    ahead = 0.1 * np.array([np.cos(HEADING), np.sin(HEADING)])
    return {
        "left": Placement(own["right"].place, HEADING),
        "right": Placement(own["left"].place + ahead, HEADING),
    }


def test_a_stand_needs_no_step(robot: Robot) -> None:
    assert not stands_badly(own_feet(robot), HEADING, robot)
    assert steps_into_stand(own_feet(robot), HEADING, robot, DT) is None


@pytest.mark.parametrize("turn", [0.9, -0.9])
def test_a_foot_that_is_turned_away_is_placed_again(robot: Robot, turn: float) -> None:
    feet = dict(own_feet(robot))
    feet["left"] = replace(feet["left"], yaw=HEADING + turn)
    walk = steps_into_stand(feet, HEADING, robot, DT)
    assert walk is not None
    assert walk.in_air.any(0).tolist() == [True, False]
    assert walk.feet["left"].yaw == pytest.approx(HEADING)


@pytest.mark.parametrize("out", [0.0, 0.04, -0.04])
def test_toes_that_point_in_or_out_do_not_turn_the_feet(out: float, tmp_path: Path) -> None:
    """Each foot was turned by the angle of its own toe where the clip and the stand meet."""
    described = machine.description(tmp_path)
    sites = dict(described.sites)
    for side, sign in (("left", 1), ("right", -1)):
        body, (x, y, z) = sites[f"{side}_toe"]
        sites[f"{side}_toe"] = (body, (x, y + sign * out, z))
    robot = load_robot(replace(described, sites=sites))
    assert robot.toe_arms["left_toe"][1] == pytest.approx(out)
    points = own_stand(robot) @ about_up(HEADING).T
    feet = feet_of(points, HEADING, robot)
    assert [feet[side].yaw for side in SIDES] == pytest.approx([HEADING, HEADING])
    placed = points.copy()
    place_feet(placed, feet, robot)
    np.testing.assert_allclose(placed, points, atol=1e-9)


def test_crossed_feet_are_uncrossed_one_after_the_other(robot: Robot) -> None:
    feet = exchanged(robot)
    walk = steps_into_stand(feet, HEADING, robot, DT)
    assert walk is not None
    assert not walk.in_air.all(1).any(), "one foot always stays"
    assert walk.in_air.any(0).all(), "both feet step"
    first = int(np.argmax(walk.in_air.any(1)))
    assert walk.in_air[first].tolist() == [False, True], "the foot in front goes first"
    assert not stands_badly(walk.feet, HEADING, robot)
    end = stand_over(walk.feet, HEADING, robot)
    np.testing.assert_allclose(walk.keypoints_w[-1], end, atol=1e-9)


def test_feet_move_in_the_air_alone_and_the_body_is_over_the_other(robot: Robot) -> None:
    feet = exchanged(robot)
    walk = steps_into_stand(feet, HEADING, robot, DT)
    assert walk is not None
    names, points = robot.keypoint_names, walk.keypoints_w
    for k, side in enumerate(SIDES):
        ankle = points[:, names.index(f"{side}_foot")]
        moves = np.linalg.norm(np.diff(ankle[:, :2], axis=0), axis=1) > 1e-9
        assert not (moves & ~walk.in_air[1:, k]).any()
        lifted = ankle[:, 2] - ankle[0, 2]
        assert lifted.max() == pytest.approx(CLEARANCE_M, rel=0.05)
        other = points[:, names.index(f"{SIDES[1 - k]}_foot"), :2]
        pelvis = points[:, names.index("pelvis"), :2]
        away = np.linalg.norm(pelvis - other, axis=1)[walk.in_air[:, k]]
        assert away.max() < 0.06


def test_nothing_jumps(robot: Robot) -> None:
    feet = exchanged(robot)
    walk = steps_into_stand(feet, HEADING, robot, DT)
    assert walk is not None
    start = stand_over(feet, HEADING, robot)
    speeds = np.linalg.norm(np.diff([start, *walk.keypoints_w], axis=0), axis=-1) / DT
    assert speeds.max() < 3.0


def test_a_clip_that_ends_on_crossed_legs_ends_in_the_stand(robot: Robot) -> None:
    clip, _ = human_clip(human("dance_b"), robot.description.control_dt, "no", 1.0, CycleConfig())
    aims = targets(clip, robot)
    tailed = with_tails(aims, robot, TailConfig(use="yes", stand_s=0.5))
    yaw = np.arctan2(aims.heading[-1, 1, 0], aims.heading[-1, 0, 0])
    assert stands_badly(feet_of(aims.keypoints_w[-1], yaw, robot), yaw, robot)
    last = tailed.aims.keypoints_w[-1]
    assert not stands_badly(feet_of(last, yaw, robot), yaw, robot)
    after = tailed.aims.contact[tailed.clip.stop :]
    assert (after == AIR).any()
    assert (after[-10:] == PLANTED).all()
