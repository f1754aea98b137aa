"""Bars hold for the clip and for its tails, apart: neither dilutes what is wrong with the other.

Tails stand still, mostly, and are longer than many clips.
"""

from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from robojackson.motion.smpl_sequence import PLANTED
from robojackson.retarget import danced_motion
from robojackson.retarget.feasibility.tempo import warped
from robojackson.retarget.feasible_motion import Feasible
from robojackson.retarget.retarget_config import RetargetConfig
from robojackson.retarget.retargeting import assemble
from robojackson.retarget.scorecard_gate import BARS, failures
from robojackson.retarget.solver.clip_problem import Problem
from robojackson.retarget.targets.cycle import CycleConfig, human_clip
from robojackson.retarget.targets.human_clip import HumanClip
from robojackson.retarget.targets.keypoint_targets import Targets, every_second, targets
from robojackson.retarget.targets.tails import TailConfig, Tailed, with_tails
from robojackson.retarget.whole_clip import faults
from robojackson.rl.modes.reset_states import default_standing_pose
from robojackson.robot.model import Robot
from robojackson.robot.tree_kinematics import pose, tree
from tests.fixtures.robots import human

CONFIG = RetargetConfig(tails=TailConfig(use="yes"), cyclic="no")
DT = 0.015


@pytest.fixture
def clip() -> HumanClip:
    return human_clip(human("dance_b").part(slice(0, 40)), DT, "no", 1.0, CycleConfig())[0]


@pytest.fixture
def tailed(robot: Robot, clip: HumanClip) -> Tailed:
    return with_tails(targets(clip, robot), robot, CONFIG.tails)


def glided(robot: Robot, aims: Targets, some: np.ndarray, speed: float) -> np.ndarray:
    """Return a stand that glides forward over some of the steps, m/s."""
    qpos = np.repeat(robot.standing[None], len(aims), 0)
    qpos[1:, 0] += np.cumsum((some[1:] & some[:-1]) * speed * DT)
    return qpos


@pytest.mark.parametrize("of_the_clip", [True, False])
def test_a_clip_or_tails_that_slip_are_a_fault_however_long_the_rest_stands(
    of_the_clip: bool, robot: Robot, tailed: Tailed
) -> None:
    aims = replace(tailed.aims, contact=np.full_like(tailed.aims.contact, PLANTED))
    assert aims.danced is not None
    assert aims.danced.mean() < 0.25
    some = aims.danced if of_the_clip else ~aims.danced
    qpos = glided(robot, aims, some, 0.018)
    found = faults(Problem.of(robot, aims, CONFIG.weights), qpos, CONFIG)
    assert found.slip_m_s == pytest.approx(0.018, rel=0.02)
    assert found.slips
    still = glided(robot, aims, some, 0.0)
    assert not faults(Problem.of(robot, aims, CONFIG.weights), still, CONFIG).slips


def test_targets_know_the_clip_s_steps_at_any_rate_and_tempo(robot: Robot, tailed: Tailed) -> None:
    aims, part = tailed.aims, tailed.clip
    assert aims.danced is not None
    np.testing.assert_array_equal(np.flatnonzero(aims.danced)[[0, -1]], [part.start, part.stop - 1])
    half = every_second(aims).danced
    assert half is not None
    np.testing.assert_array_equal(half, aims.danced[::2])
    steps = np.arange(0.0, len(aims) - 1, 0.6)
    slower = warped(aims, steps)
    able = Feasible(np.zeros((len(steps), 7)), slower, steps, part)
    np.testing.assert_array_equal(slower.danced, able.danced)


@pytest.mark.parametrize(("share", "solved_again"), [(0.06, True), (0.02, False)])
def test_a_flight_that_does_not_fall_is_removed_by_its_share_of_the_clip(
    share: float,
    solved_again: bool,
    robot: Robot,
    clip: HumanClip,
    tailed: Tailed,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Solved again from half the share that the gate refuses."""
    assert share != BARS["unsupported_share"] / 2
    plain = replace(targets(clip, robot), airborne=np.ones(len(clip.time_s), bool))
    hovering = np.zeros(len(tailed.aims), bool)
    first = tailed.clip.start
    hovering[first : first + round(share * len(plain))] = True
    polished: list[Targets] = []

    def solution(aims: Targets, *_: object) -> SimpleNamespace:
        qpos = np.repeat(robot.standing[None], len(aims), 0)
        nothing = SimpleNamespace(any=False)
        shift = np.zeros(2)
        return SimpleNamespace(qpos=qpos, aims=aims, shift=shift, faults=nothing, lean_deg=0.0)

    def polish(aims: Targets, *_: object) -> SimpleNamespace:
        polished.append(aims)
        return solution(aims)

    monkeypatch.setattr(danced_motion, "optimise", lambda *given: (solution(*given), 0.0))
    monkeypatch.setattr(danced_motion, "polished", polish)
    monkeypatch.setattr(danced_motion, "hovers", lambda *_: hovering)
    monkeypatch.setattr(danced_motion, "_over_the_feet", lambda stiff, *_: (stiff, 0.0))
    danced_motion._solved(clip, robot, CONFIG, cast(Targets, plain), True)
    assert bool(polished) == solved_again


STANDS, WAYS, CLIP = [(0, 60), (200, 300)], [(60, 100), (150, 200)], [(100, 150)]


def steps_of(spans: list[tuple[int, int]]) -> np.ndarray:
    found = np.zeros(300, bool)
    for start, end in spans:
        found[start:end] = True
    return found


@pytest.mark.parametrize(
    ("leans", "part"),
    [([], CLIP), ([(100, 120)], CLIP), ([(160, 180)], WAYS), ([(220, 300)], STANDS)],
)
def test_the_gate_refuses_what_the_robot_cannot_do_in_the_clip_its_ways_or_its_stands(
    leans: list[tuple[int, int]], part: list[tuple[int, int]], robot: Robot
) -> None:
    """A robot that fell over in the last stand passed."""
    qpos = np.repeat(default_standing_pose(robot)[None], 300, 0)
    leaning = steps_of(leans)
    qpos[leaning, 3], qpos[leaning, 4] = np.cos(0.175), np.sin(0.175)
    points = np.repeat(pose(tree(robot), qpos[:1]).site_pos, 300, 0)
    points[:, -1, 0] += 1e-3 * np.cumsum(steps_of(WAYS))
    aims = Targets(
        keypoints_w=points,
        weights=np.ones(points.shape[:2]),
        contact=np.full((300, 2), PLANTED),
        heading=np.repeat(np.eye(3)[None], 300, 0),
        dt=DT,
        cycle_offset=None,
        airborne=np.zeros(300, bool),
    )
    time_s = np.zeros(300)
    card = assemble(
        qpos, time_s, aims, aims, robot, {}, CONFIG.weights.tolerance, steps_of(CLIP)
    ).scorecard
    share = leaning.sum() / steps_of(part).sum()
    assert card["infeasible_share"] == pytest.approx(share, abs=0.1)
    assert ("infeasible_share" in failures(card)) == bool(leans)
    assert not (leans and card["passed"])
