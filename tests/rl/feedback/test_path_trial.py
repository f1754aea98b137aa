"""The trial of a regulator: falls and the strict rule for the keypoints."""

from dataclasses import replace

import numpy as np
import pytest

from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.rl.config.train_config import ControlConfig
from robojackson.rl.feedback.driven_clip import driven_clip
from robojackson.rl.feedback.keypoint_rule import KeypointRule
from robojackson.rl.feedback.path_trial import Held, Trial
from robojackson.rl.feedback.regulator import regulator
from robojackson.rl.feedback.standing_feet import Feet
from robojackson.rl.sim.motors import residual_scale
from robojackson.rl.sim.simulation import Simulation
from robojackson.robot.model import Robot

LED = ControlConfig(feedforward=1.0, feedback=0.0)


def ruled(robot: Robot, **limits: float) -> Robot:
    """Return the robot with other limits of strict success."""
    strict = replace(robot.description.strict, **limits)
    return replace(robot, description=replace(robot.description, strict=strict))


def test_a_hand_that_is_too_high_and_a_bent_body_break_the_rule(robot: Robot) -> None:
    rule = KeypointRule(ruled(robot, ends=0.25, sites=0.1))
    aimed = np.tile(robot.standing, (3, 1))
    qpos = aimed.copy()
    qpos[1, 7:][robot.joint_names.index("left_shoulder1")] += 1.5
    qpos[2, 7:][robot.joint_names.index("abdomen_y")] -= 1.2
    points = rule.points(aimed)
    np.testing.assert_array_equal(rule.keeps(qpos, aimed, points), [True, False, False])
    np.testing.assert_array_equal(
        KeypointRule(ruled(robot, sites=10.0)).keeps(qpos, aimed, points), [True] * 3
    )


def test_the_place_and_the_heading_do_not_count(robot: Robot) -> None:
    rule = KeypointRule(ruled(robot, ends=0.01, sites=0.01))
    aimed = np.tile(robot.standing, (1, 1))
    qpos = aimed.copy()
    qpos[:, :2] += [3.0, -2.0]
    qpos[:, 3:7] = [np.cos(0.4), 0, 0, np.sin(0.4)]
    assert rule.keeps(qpos, aimed, rule.points(aimed)).all()


@pytest.mark.medium
def test_robots_that_break_the_rule_come_to_the_end_and_do_not_count(
    robot: Robot, sway: ReferenceMotion, monkeypatch: pytest.MonkeyPatch
) -> None:
    clip, sim = driven_clip(robot, sway, LED), Simulation(robot, LED, 1)
    action = residual_scale(robot, ControlConfig())
    gains, path, _ = regulator(sim, clip, action, Feet(robot).count)
    monkeypatch.setattr("robojackson.rl.feedback.path_trial.HELD_S", 0.6)
    found = [
        Trial(ruled(robot, sites=sites), sim, clip, action, path).held(gains)
        for sites in (1.0, 1e-4)
    ]
    assert found[0].strictly == found[0].to_end > 0
    assert found[1].strictly == 0.0
    assert found[1][1:] == found[0][1:]


@pytest.mark.parametrize(
    ("mine", "theirs", "wins"),
    [
        (Held(0.0, 0.94, 0.95), Held(0.02, 0.02, 0.46), True),  # both hold little strictly
        (Held(0.02, 0.02, 0.46), Held(0.0, 0.94, 0.95), False),
        (Held(0.2, 0.2, 0.5), Held(0.1, 0.94, 0.9), True),  # five starts more by the strict rule
        (Held(0.6, 0.6, 0.7), Held(0.58, 0.94, 0.95), True),  # half is held: strictly first
        (Held(0.1, 0.3, 0.6), Held(0.1, 0.3, 0.5), True),
        (Held(0.1, 0.3, 0.5), Held(0.1, 0.3, 0.5), False),
    ],
)
def test_where_little_is_held_by_the_rule_those_that_come_to_the_end_decide(
    mine: Held, theirs: Held, wins: bool
) -> None:
    assert mine.beats(theirs) == wins
