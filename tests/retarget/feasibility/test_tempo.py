"""Warps are smooth, never too slow, keep cycles closed, and come only where slowing down helps."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from robojackson.retarget import retargeting
from robojackson.retarget.feasibility import inverse_dynamics
from robojackson.retarget.feasibility.contact_wrench import Tolerance, supply
from robojackson.retarget.feasibility.tempo import (
    GRID,
    feasible_tempo,
    required_rate,
    slacks,
    smooth_rate,
    times_at,
    warp,
    warped,
)
from robojackson.retarget.feasible_motion import Feasible
from robojackson.retarget.retarget_config import RetargetConfig
from robojackson.retarget.retargeting import retarget_motion
from robojackson.retarget.targets.cycle import human_clip
from robojackson.retarget.targets.keypoint_targets import Targets, targets
from robojackson.robot.model import Robot
from robojackson.robot.tree_kinematics import pose, tree
from tests.fixtures.robots import human, robot_motion

DT = 0.015


def _rate(count: int, slowest: float) -> np.ndarray:
    expected = np.ones(count)
    expected[count // 3 : count // 2] = slowest
    return smooth_rate(expected, DT, ring=False)


def test_a_rate_of_one_changes_nothing():
    np.testing.assert_allclose(warp(np.ones(50), ring=False), np.arange(50))
    np.testing.assert_allclose(warp(np.ones(50), ring=True), np.arange(50))


@pytest.mark.parametrize("slowest", [0.5, 0.8])
def test_a_warp_ends_where_the_motion_ends_and_runs_at_the_rate(slowest: float):
    rate = _rate(200, slowest)
    steps = warp(rate, ring=False)
    assert (steps[0], steps[-1]) == pytest.approx((0.0, 199.0))
    pace = np.diff(steps)
    np.testing.assert_allclose(pace, np.interp(steps[:-1], np.arange(200), rate), atol=0.02)
    assert pace.min() >= slowest * 0.99
    assert pace.max() <= 1.0 + 1e-9


def test_a_half_tempo_takes_twice_as_long():
    assert len(warp(np.full(101, 0.5), ring=False)) == 201
    assert len(warp(np.full(100, 0.5), ring=True)) == 200


def test_the_rate_is_smooth():
    """A change of tempo of a half takes longer than a tenth of a second."""
    assert np.abs(np.diff(_rate(200, 0.5))).max() < 0.5 * DT / 0.1


def test_a_warped_cycle_still_travels_its_cycle(robot: Robot):
    aims = _aims(robot)
    steps = warp(np.full(len(aims), 0.7), ring=True)
    slower = warped(aims, steps)
    assert slower.cycle_offset is not None
    step = slower.keypoints_w[:, 0, 0]
    closing = step[0] + slower.cycle_offset[0] - step[-1]
    assert closing == pytest.approx(np.diff(step)[-1], abs=0.005)


def test_targets_at_whole_steps_are_the_targets(robot: Robot):
    aims = _aims(robot)
    same = warped(aims, np.arange(len(aims), dtype=float))
    np.testing.assert_allclose(same.keypoints_w, aims.keypoints_w, atol=1e-9)
    np.testing.assert_array_equal(same.contact, aims.contact)


def test_source_times_follow_the_warp():
    time_s = 2.0 + np.arange(10) * 0.03
    np.testing.assert_allclose(times_at(time_s, np.array([0.0, 2.5, 9.5])), [2.0, 2.075, 2.285])


def _slack(*values: float) -> np.ndarray:
    return np.array(values)[:, None]


def test_the_fastest_feasible_tempo_is_chosen():
    slack = _slack(2.0, 1.2, 0.9, 0.5, 0.4, 0.3)
    assert feasible_tempo(slack)[0] == GRID[2] == required_rate(slack)[0]


def test_what_slowing_down_does_not_help_keeps_its_tempo():
    """A pose on one foot with the weight beside it is no better when it is held longer."""
    slack = _slack(2.0, 2.0, 2.1, 2.1, 2.2, 2.3)
    assert feasible_tempo(slack)[0] == 0.0
    assert required_rate(slack)[0] == 1.0


def _hurried(robot: Robot, tempo: float | str) -> dict[str, float]:
    """Retarget the hip shake as if it had been filmed at a third of its speed, hardly repaired."""
    fast = replace(human("hip_shake"), fps=90.0)
    gentle = replace(RetargetConfig().repair, weights=(1e-5,))
    config = RetargetConfig(tempo=tempo, repair=gentle)  # type: ignore[arg-type]
    return dict(retarget_motion(fast, robot, config).scorecard)


@pytest.mark.slow
def test_auto_slows_a_hurried_dance_down_and_says_by_how_much(robot: Robot):
    kept, slowed = _hurried(robot, 1.0), _hurried(robot, "auto")
    assert kept["tempo_min"] == pytest.approx(1.0)
    assert 0.5 <= slowed["tempo_min"] < 0.97
    assert slowed["seconds"] == pytest.approx(kept["seconds"] / slowed["tempo_mean"], rel=1e-6)
    assert slowed["infeasible_share"] < 0.5 * kept["infeasible_share"]
    assert slowed["seam_deg"] < 1.0


def test_auto_keeps_a_tempo_that_fits():
    assert robot_motion("walk").scorecard["tempo_mean"] == 1.0


def _aims(robot: Robot) -> Targets:
    clip, _ = human_clip(human("walk"), DT, "auto", 1.0, RetargetConfig().cycle)
    return targets(clip, robot)


def test_slower_tempos_are_tried_where_the_own_one_is_too_fast(robot: Robot):
    """The same as solving every step at every tempo."""
    qpos = robot_motion("walk").qpos[::2]  # twice as fast
    found = slacks(robot, qpos, DT, None, Tolerance())
    hard = found[0] > 1.0
    assert 0 < hard.sum() < len(hard)
    np.testing.assert_array_equal(found[:, ~hard], np.tile(found[0, ~hard], (len(GRID), 1)))
    forces = inverse_dynamics.free_space(robot, qpos, DT, None)
    near = inverse_dynamics.touching(robot, pose(tree(robot), qpos))
    for row, k in zip(found, GRID, strict=True):
        demand = inverse_dynamics.demand(robot, qpos, forces.at(k), near, Tolerance())
        np.testing.assert_allclose(row[hard], supply(demand).slack[hard], atol=1e-6)


@pytest.mark.parametrize("rate", [0.5, 0.7, 1.0])
def test_the_tempo_is_that_of_the_dance_without_its_tails(rate: float) -> None:
    """70 steps before it, 180 of the dance, 200 after it."""
    dance = np.arange(69.5 + rate / 2, 249.5, rate)
    steps = np.concatenate([np.arange(70.0), dance, np.arange(250.0, 450.0)])
    aims = SimpleNamespace(keypoints_w=np.zeros((len(steps), 14, 3)), dt=0.02, cycle_offset=None)
    able = Feasible(np.zeros((len(steps), 7)), cast(Any, aims), steps, slice(70, 250))
    robot = SimpleNamespace(keypoint_weights=np.ones(14))
    found = retargeting._slowing(able, cast(Any, aims), cast(Any, robot))
    assert found["tempo_mean"] == pytest.approx(rate, abs=0.01)
    assert found["tempo_min"] == pytest.approx(rate, abs=0.01)
    tails = retargeting._tail_seconds(able.danced, 0.02)
    assert tails == pytest.approx({"lead_s": 1.4, "tail_s": 4.0}, abs=0.021)


def test_a_cycle_that_is_slowed_as_a_whole_has_no_tail() -> None:
    steps = warp(np.full(100, 0.3), ring=True)
    aims = SimpleNamespace(cycle_offset=np.zeros(3))
    able = Feasible(np.zeros((len(steps), 7)), cast(Any, aims), steps, slice(0, 100))
    assert able.danced.all()
