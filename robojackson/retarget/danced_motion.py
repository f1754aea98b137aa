"""The motion of a clip for a robot: its hops as they are, or steps in place of them, repaired."""

import logging
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from robojackson.retarget.feasible_motion import Feasible, feasible_share, make_feasible
from robojackson.retarget.retarget_config import RetargetConfig
from robojackson.retarget.scorecard import hovers
from robojackson.retarget.scorecard_gate import BARS
from robojackson.retarget.targets.human_clip import HumanClip
from robojackson.retarget.targets.keypoint_targets import Targets, targets
from robojackson.retarget.targets.tails import Tailed, with_tails
from robojackson.retarget.whole_clip import Optimised, optimise, polished
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
        lean_deg: Lean that puts the body over its feet, degrees.
    """

    tailed: Tailed
    upright: Targets
    able: Feasible
    floor_mm: float
    lean_deg: float


class _Solution(NamedTuple):
    """A motion before repair: as in `Dance`, and the solution."""

    tailed: Tailed
    upright: Targets
    found: Optimised
    floor_mm: float

    def repaired(self, robot: Robot, config: RetargetConfig) -> Dance:
        """Return the motion after repair."""
        clip, found = self.tailed.clip, self.found
        able = make_feasible(robot, found.qpos, found.aims, config, clip)
        return Dance(self.tailed, self.upright, able, self.floor_mm, found.lean_deg)


def danced_motion(clip: HumanClip, robot: Robot, config: RetargetConfig) -> Dance:
    """Return the motion with its hops; with steps in place of hops that are no flights where the
    robot can do only these.

    A motion whose hops stay out of reach after the first repair is tried with steps before it is
    repaired further: that takes most of the time, and rarely helps.
    """
    least = 1.0 - BARS["infeasible_share"]
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
        if share >= least:
            return found
    _log.info("%.0f %% feasible: solving with steps in place of hops", 100 * share)
    other = _solved(clip, robot, config, stepped, hops=False).repaired(robot, config)
    other_share = feasible_share(robot, other.able, config)
    if share < _WITHIN_REACH and other_share < least:
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
    hovering = hovers(robot, found.qpos, aims.dt)
    if hovering.mean() > BARS["unsupported_share"] / 2 and aims.airborne.any():
        _log.info("removed a flight that does not fall: solving again")
        grounded = targets(clip, robot, hovering[tailed.clip], hops)
        upright = with_tails(grounded, robot, config.tails).aims
        found = polished(upright, found.qpos, found.shift, robot, config)
    return _Solution(tailed, upright, found, floor_mm)
