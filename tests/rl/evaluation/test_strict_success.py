"""Strict success against a reference: feet, hands and other bodies on the floor."""

import dataclasses

import numpy as np
import pytest

from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.rl.config.train_config import ControlConfig, EvaluateConfig
from robojackson.rl.evaluation.rollout_records import RolloutScorer
from robojackson.rl.evaluation.rollouts import Driver, Rollouts, Starts, roll_out
from robojackson.rl.evaluation.starts import LOST, summarise
from robojackson.rl.evaluation.strict_success import StrictEvaluator
from robojackson.rl.sim.reference_clip import Clip
from robojackson.robot.description import FallRule, StrictRule
from robojackson.robot.fall import Fall
from robojackson.robot.model import Robot, load_robot

STEPS = 100


@pytest.fixture(scope="module")
def reference_rules(robot: Robot) -> Robot:
    changed = dataclasses.replace(
        robot.description,
        fall=FallRule(frame="reference", height=0.25, tilt=0.8),
        strict=StrictRule(sites=0.2, ends=0.25, knees=None, floor=True),
    )
    return load_robot(changed)


def perfect(sway: ReferenceMotion, start: int = 0) -> Rollouts:
    at = Clip(sway).at(start + 1 + np.arange(STEPS))
    arrays = at.qpos[:, None], at.points[:, None], at.points[:, None], at.qpos[:, None]
    return Rollouts(
        np.array([STEPS]), np.array([False]), np.array([STEPS]), *arrays, totals={}, whole=True
    )


def findings(robot: Robot, sway: ReferenceMotion, rollouts: Rollouts, start: int = 0):
    evaluator = StrictEvaluator(robot, sway, EvaluateConfig())
    return evaluator.findings(rollouts, 0, slice(0, STEPS), start, np.zeros(STEPS))


def lying(rollouts: Rollouts, first: int) -> Rollouts:
    """Return the rollouts with the torso on the floor from a step on."""
    qpos = rollouts.qpos.copy()
    qpos[first:, 0, 2] = 0.1
    qpos[first:, 0, 3:7] = [np.cos(np.pi / 4), 0.0, np.sin(np.pi / 4), 0.0]
    return dataclasses.replace(rollouts, qpos=qpos)


def test_the_reference_itself_breaks_no_rule(reference_rules: Robot, sway: ReferenceMotion) -> None:
    assert not findings(reference_rules, sway, perfect(sway, 7), 7).any


def test_a_body_on_the_floor_is_found(reference_rules: Robot, sway: ReferenceMotion) -> None:
    assert findings(reference_rules, sway, lying(perfect(sway), 60)).floor


def test_where_the_reference_lies_a_robot_may_lie(
    reference_rules: Robot, sway: ReferenceMotion
) -> None:
    flat = lying(perfect(sway), 0)
    one = len(sway)
    motion = dataclasses.replace(sway, qpos=np.repeat(flat.qpos[:1, 0], one, 0))
    assert not findings(reference_rules, motion, flat).floor


@pytest.mark.parametrize(("lift", "broken"), [(0.24, False), (0.26, True)])
def test_a_hand_may_be_25_cm_too_high(
    reference_rules: Robot, sway: ReferenceMotion, lift: float, broken: bool
) -> None:
    done = perfect(sway)
    points = done.points.copy()
    points[40, 0, reference_rules.keypoint_names.index("left_hand"), 2] += lift
    found = findings(reference_rules, sway, dataclasses.replace(done, points=points))
    assert found.ends is broken
    assert found.worst_end_m == pytest.approx(lift)


def test_a_summary_counts_the_rollouts_that_each_rule_lost(
    reference_rules: Robot, sway: ReferenceMotion
) -> None:
    done = perfect(sway)
    points = done.points.copy()
    points[40, 0, reference_rules.keypoint_names.index("left_hand"), 2] += 0.3
    scorer = RolloutScorer(reference_rules, sway, EvaluateConfig())
    far = dataclasses.replace(done, points=points)
    fell = dataclasses.replace(lying(done, 60), fell=np.array([True]))
    made = {"far": far, "lies": lying(done, 60), "fell": fell, "perfect": done}
    rows = [scorer.row(name, (0, 0), rollouts, 0) for name, rollouts in made.items()]
    found = summarise(rows)
    lost = {key: found[key] for key in ("lost_fell", *LOST)}
    assert lost == {
        "lost_fell": 1.0, "lost_sites": 0.0, "lost_ends": 1.0, "lost_kneels": 0.0,
        "lost_floor": 1.0,
    }  # fmt: skip


def test_a_robot_that_fell_is_counted_to_the_horizon(
    reference_rules: Robot, sway: ReferenceMotion
) -> None:
    """Limp robots: their position error over the whole horizon exceeds that until the fall."""
    robot, horizon = reference_rules, np.full(2, 150)
    starts = Starts(np.zeros(2, int), sway.qpos[[0, 0]], sway.qvel[[0, 0]])
    limp = Driver(ControlConfig(stiffness=1e-6), lambda sim, *rest: np.zeros((sim.n, 17)))
    done = roll_out(
        robot, Clip(sway), limp, starts, horizon, 1, Fall.of(robot), whole=True
    )  # fmt: skip
    assert done.fell.all()
    assert len(done.qpos) == 150
    last = done.qpos[-1, 0, 2]
    assert last < done.qpos[int(done.length[0]), 0, 2] - 0.2, "it went on falling"
    row = RolloutScorer(robot, sway, EvaluateConfig()).row("trained", (0, 0), done, 0)
    assert row["mpjpe_g_m"] > 1.5 * row["mpjpe_g_alive_m"]  # type: ignore[operator]
    stopped = roll_out(robot, Clip(sway), limp, starts, horizon, 1, Fall.of(robot))
    row = RolloutScorer(robot, sway, EvaluateConfig()).row("trained", (0, 0), stopped, 0)
    assert np.isnan(row["mpjpe_g_m"])  # type: ignore[call-overload]
