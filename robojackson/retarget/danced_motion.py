"""The motion of a clip for a robot: its hops as they are, or steps in place of them.

It sways over the feet that carry it where it has to, and is repaired.
"""

import logging
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from robojackson.retarget.feasible_motion import Feasible, feasible_share, given, make_feasible
from robojackson.retarget.retarget_config import RetargetConfig
from robojackson.retarget.scorecard import hovers
from robojackson.retarget.scorecard_gate import BARS, LEAST_FEASIBLE
from robojackson.retarget.solver.clip_problem import Problem
from robojackson.retarget.solver.sway import swayed
from robojackson.retarget.targets.human_clip import HumanClip
from robojackson.retarget.targets.keypoint_targets import Targets, targets
from robojackson.retarget.targets.tails import Tailed, with_tails
from robojackson.retarget.whole_clip import optimise, polished
from robojackson.robot.model import Robot

_log = logging.getLogger(__name__)
_WITHIN_REACH = 0.8
"""Share of feasible steps after the first repair below which hops are not repaired further before
steps are tried in their place."""


class Dance(NamedTuple):
    """A solved motion.

    Attributes:
        tailed: Targets with stands around the clip.
        upright: The dancer's own motion, not leaned.
        able: The motion after repair.
        floor_mm: Mean error of every frame solved by itself, mm.
        lean_deg: Lean that puts a standing body over its feet, degrees.
        sway_m: Largest sway over the feet, at the height of the centre of mass, metres.
    """

    tailed: Tailed
    upright: Targets
    able: Feasible
    floor_mm: float
    lean_deg: float
    sway_m: float


class _Solution(NamedTuple):
    """A motion before repair: as in `Dance`, the solution, and the one before it swayed. What a
    repair computes stays with both for the next."""

    tailed: Tailed
    upright: Targets
    found: Feasible
    stiff: Feasible
    floor_mm: float
    lean_deg: float
    sway_m: float

    def repaired(self, robot: Robot, config: RetargetConfig) -> Dance:
        """Return the motion after repair; that without sway where the sway is just not enough and
        more of the other is feasible."""
        dance = self._repaired(self.found, self.sway_m, robot, config)
        share = feasible_share(robot, dance.able, config)
        if self.sway_m == 0.0 or not _WITHIN_REACH <= share < LEAST_FEASIBLE:
            return dance
        stiff = self._repaired(self.stiff, 0.0, robot, config)
        return stiff if feasible_share(robot, stiff.able, config) > share else dance

    def _repaired(
        self, found: Feasible, sway_m: float, robot: Robot, config: RetargetConfig
    ) -> Dance:
        able = make_feasible(robot, found, config)
        return Dance(self.tailed, self.upright, able, self.floor_mm, self.lean_deg, sway_m)


def danced_motion(clip: HumanClip, robot: Robot, config: RetargetConfig) -> Dance:
    """Return the motion with its hops; with steps in place of hops that are no flights where the
    robot can do only these.

    A motion whose hops stay out of reach after the first repair is tried with steps before it is
    repaired further: that takes most of the time, and rarely helps.
    """
    hopped, stepped = (targets(clip, robot, hops=hops) for hops in (True, False))
    hops = _solved(clip, robot, config, hopped, hops=True)
    if np.array_equal(stepped.contact, hopped.contact):
        return hops.repaired(robot, config)
    tried = hops.repaired(robot, _first_repair(config))
    share = feasible_share(robot, tried.able, config)
    if share >= config.repair.target_share:
        return tried  # nothing more would be repaired
    if share >= _WITHIN_REACH:
        found = hops.repaired(robot, config)
        share = feasible_share(robot, found.able, config)
        if share >= LEAST_FEASIBLE:
            return found
    _log.info("%.0f %% feasible: solving with steps in place of hops", 100 * share)
    other = _solved(clip, robot, config, stepped, hops=False).repaired(robot, config)
    other_share = feasible_share(robot, other.able, config)
    if share < _WITHIN_REACH and other_share < LEAST_FEASIBLE:
        found = hops.repaired(robot, config)
        share = feasible_share(robot, found.able, config)
    return other if other_share > share else found


def _first_repair(config: RetargetConfig) -> RetargetConfig:
    """Return the configuration of a repair at the least weight, without slowing."""
    repair = replace(config.repair, weights=config.repair.weights[:1], slow_rounds=0)
    return replace(config, repair=repair)


def _solved(
    clip: HumanClip, robot: Robot, config: RetargetConfig, plain: Targets, hops: bool
) -> _Solution:
    """Solve the targets of a clip, with stands around it."""
    tailed = with_tails(plain, robot, config.tails)
    upright = aims = tailed.aims
    found, floor_mm = optimise(aims, robot, config)
    hovering = hovers(robot, found.qpos, aims.dt, aims.cycle_offset is not None)
    if hovering[tailed.clip].mean() > BARS["unsupported_share"] / 2 and aims.airborne.any():
        _log.info("removed a flight that does not fall: solving again")
        grounded = targets(clip, robot, hovering[tailed.clip], hops)
        upright = with_tails(grounded, robot, config.tails).aims
        found = polished(upright, found.qpos, found.shift, robot, config)
    stiff = given(found.qpos, found.aims, tailed.clip)
    balanced, sway_m = _over_the_feet(stiff, found.faults.any, robot, config)
    return _Solution(tailed, upright, balanced, stiff, floor_mm, found.lean_deg, sway_m)


def _over_the_feet(
    stiff: Feasible, faulty: bool, robot: Robot, config: RetargetConfig
) -> tuple[Feasible, float]:
    """Return the solution of targets that sway over the feet, where more of it is feasible, and
    the largest sway, metres.

    Args:
        stiff: The solution without sway.
        faulty: Whether it breaks a hard bar; else the other must not, either.
        robot: The robot.
        config: Settings.
    """
    best, most = stiff, feasible_share(robot, stiff, config)
    total, sway_m = np.zeros((len(stiff.qpos), 2)), 0.0
    for _ in range(config.sway.passes):
        if most >= config.repair.target_share:
            break
        problem = Problem.of(robot, best.aims, config.weights)
        aims, sway = swayed(problem, best.qpos, config.sway)
        solved = polished(aims, best.qpos, np.zeros(2), robot, config)
        latest = given(solved.qpos, solved.aims, stiff.clip)
        reached = feasible_share(robot, latest, config)
        if reached <= most or solved.faults.any > faulty:
            break
        best, most, total = latest, reached, total + sway
        sway_m = float(np.linalg.norm(total, axis=1).max())
        _log.info("swayed by up to %.0f cm: %.0f %% feasible", 100 * sway_m, 100 * most)
    return best, sway_m
