"""Make a motion one that the robot can really do: repair what bends, slow down what does not.

Rounds of solving with the dynamics term in the cost, its weight rising until enough steps are
feasible or the motion would be bent too far; where that is not enough and the tempo is free, the
motion is slowed down locally and repaired again.
"""

import logging
from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np
from jaxtyping import Bool, Float
from scipy.ndimage import maximum_filter1d

from robojackson.metrics.retarget_error import keypoint_error_mm
from robojackson.retarget.feasibility import tempo
from robojackson.retarget.retarget_config import RetargetConfig
from robojackson.retarget.scorecard_gate import LEAST_FEASIBLE
from robojackson.retarget.solver.clip_problem import Problem
from robojackson.retarget.solver.levenberg_marquardt import clip_to_limits, solve
from robojackson.retarget.targets.keypoint_targets import Targets
from robojackson.retarget.targets.motion_parts import moving, parts_of
from robojackson.retarget.whole_clip import faults, harden
from robojackson.robot.model import Robot
from robojackson.robot.resampling import resample
from robojackson.robot.tree_kinematics import continuous, pose, tree

_log = logging.getLogger(__name__)
_HELPS = 0.7  # share of the excess that slowing down may leave
_GUARD = 1.03  # a warp ends with a whole step: all tempos fall by less than that
_LOOSE = 1e-5  # first damping: repair moves whole bodies over many steps
_HARDLY_SLOWER = 0.97  # a tempo that is not worth a warp
_HOPELESS = 0.5  # share of feasible steps below which a heavier weight has never been enough
_BEHIND = 0.02  # a slowed motion that is so far behind does not come first by repair
_REACH_S = 0.8  # beside steps that need repair, others may change so far


@dataclass(frozen=True)
class Feasible:
    """A motion after repair.

    Attributes:
        qpos: At the control step.
        aims: Targets at its steps.
        steps: Step of the motion before repair that each step shows, fractional.
        clip: Steps of that motion that are the clip's; the others are tails.
    """

    qpos: Float[np.ndarray, "S nq"]
    aims: Targets
    steps: Float[np.ndarray, " S"]
    clip: slice
    _slack: dict[int, np.ndarray] = field(default_factory=dict, init=False, compare=False)
    _solutions: dict[float, "Feasible"] = field(default_factory=dict, init=False, compare=False)

    @property
    def danced(self) -> Bool[np.ndarray, " S"]:
        """Steps that show the clip."""
        if self.aims.cycle_offset is not None:  # a cycle is danced as a whole
            return np.ones(len(self.steps), bool)
        first, past = self.clip.start, self.clip.stop
        result: np.ndarray = (self.steps > first - 0.5) & (self.steps < past - 0.5)
        return result

    @property
    def parts(self) -> tuple[Bool[np.ndarray, " S"], ...]:
        """Steps of the clip and, apart, those that lead into and out of it, and those of the
        stands: none dilutes another's share."""
        return parts_of(self.aims, self.danced)


def make_feasible(robot: Robot, before: Feasible, config: RetargetConfig) -> Feasible:
    """Repair a motion; slow it down where its tempo is free and that helps. What no repair makes
    more feasible stays as it is, and what passes the gate where the first repair makes it worse."""
    how, share = config.repair, feasible_share(robot, before, config)
    if not how.weights or share >= how.target_share:
        return before
    first = _solved(robot, before, how.weights[0], config)
    if share >= LEAST_FEASIBLE and feasible_share(robot, first, config) < share:
        return before
    after = _best_repair(robot, before, _accepted(robot, before, first, config), config)
    return after if feasible_share(robot, after, config) > share else before


def given(qpos: Float[np.ndarray, "S nq"], aims: Targets, clip: slice | None = None) -> Feasible:
    """Return a motion before repair."""
    whole = slice(0, len(qpos))
    return Feasible(qpos, aims, np.arange(len(qpos), dtype=float), clip or whole)


def _best_repair(
    robot: Robot, before: Feasible, found: Feasible, config: RetargetConfig
) -> Feasible:
    """Go on from the first repair of a motion."""
    how = config.repair
    rounds = how.slow_rounds if config.tempo == "auto" else 0
    declined = None
    for _ in range(rounds):
        slower = _slowed(robot, found, config)
        if slower is None:
            break
        if _excess(robot, slower, config) > _HELPS * _excess(robot, found, config):
            declined = slower
            break
        found = slower
    best = _repaired(robot, before, found, config)
    share = feasible_share(robot, best, config)
    if declined is None or share >= how.target_share:
        return best
    if feasible_share(robot, declined, config) < share - _BEHIND:
        return best
    # Slowing alone hardly helped, and neither did repair: together they may.
    other = _repaired(robot, before, declined, config)
    return max(best, other, key=lambda motion: feasible_share(robot, motion, config))


def feasible_share(robot: Robot, motion: Feasible, config: RetargetConfig) -> float:
    """Return the share of feasible steps of the clip, of the ways into and out of it or of the
    stands, whichever is least: a robot falls over any."""
    return _least_share(motion, _slack(robot, motion, config))


def _least_share(motion: Feasible, slack: Float[np.ndarray, " S"]) -> float:
    return min(float((slack[part] <= 1.0).mean()) for part in motion.parts)


def _excess(robot: Robot, motion: Feasible, config: RetargetConfig) -> float:
    """Return the mean slack beyond the tolerance; a step without a solution counts as three
    tolerances."""
    over = np.clip(_slack(robot, motion, config) - 1.0, 0.0, 3.0)
    return float(over[motion.danced | moving(motion.aims)].mean())


def _slack(robot: Robot, motion: Feasible, config: RetargetConfig) -> Float[np.ndarray, " S"]:
    """Return what is left over at the motion's own tempo, computed once a motion."""
    return np.asarray(_slacks(robot, motion, config, tempo.GRID[:1])[0])


def _slacks(
    robot: Robot, motion: Feasible, config: RetargetConfig, grid: np.ndarray
) -> Float[np.ndarray, "K S"]:
    if len(grid) not in motion._slack:
        aims, tolerance, own = motion.aims, config.weights.tolerance, motion._slack.get(1)
        known = None if own is None else own[0]
        motion._slack[len(grid)] = tempo.slacks(
            robot, motion.qpos, aims.dt, aims.cycle_offset, tolerance, grid, known
        )
    return motion._slack[len(grid)]


def _solved(robot: Robot, motion: Feasible, weight: float, config: RetargetConfig) -> Feasible:
    """Solve around the steps that need it with the dynamics term, once a motion and weight; the
    hard bars hold afterwards where they can."""
    if weight in motion._solutions:
        return motion._solutions[weight]
    problem = Problem.of(robot, motion.aims, replace(config.weights, dynamics=weight))
    loose = replace(config.solver, damping=_LOOSE, tolerance=config.repair.tolerance)
    hard = _slack(robot, motion, config) > config.weights.dynamics_margin
    spans = list(_spans(hard, round(_REACH_S / motion.aims.dt)))
    rough = solve(problem, motion.qpos, loose, config.repair.iterations, spans=spans)
    final = harden(problem, rough, config, spans)
    found = replace(motion, qpos=continuous(clip_to_limits(robot, final.qpos)))
    motion._solutions[weight] = found
    return found


def _spans(hard: Bool[np.ndarray, " S"], reach: int) -> Iterator[slice]:
    """Return the steps that need repair and those within reach, as runs."""
    near = maximum_filter1d(hard.astype(int), 2 * reach + 1, mode="constant")
    edges = np.flatnonzero(np.diff(near, prepend=0, append=0))
    return (slice(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True))


def _slowed(robot: Robot, motion: Feasible, config: RetargetConfig) -> Feasible | None:
    """Return the motion solved again at the tempo that its steps need.

    None where none needs it, or where a hard bar would be broken.
    """
    aims = motion.aims
    slack = _slacks(robot, motion, config, tempo.GRID)
    if _least_share(motion, slack[0]) >= config.repair.target_share:
        return None
    rate = tempo.smooth_rate(tempo.required_rate(slack), aims.dt, aims.cycle_offset is not None)
    so_far = np.gradient(motion.steps).clip(max=1.0)
    rate = np.maximum(rate, np.minimum(_GUARD * config.repair.slowest / so_far, 1.0))
    if rate.min() > _HARDLY_SLOWER:
        return None
    steps = tempo.warp(rate, aims.cycle_offset is not None)
    _log.info("slowed down to %.2f at the slowest", rate.min())
    slower = Feasible(
        qpos=clip_to_limits(robot, resample(motion.qpos, steps, aims.cycle_offset)),
        aims=tempo.warped(aims, steps),
        steps=tempo.times_at(motion.steps, steps),
        clip=motion.clip,
    )
    solved = _solved(robot, slower, config.repair.weights[0], config)
    kept = _accepted(robot, slower, solved, config)
    # Limbs that passed through each other between two steps show it when slowed down.
    return kept if _holds(robot, kept, config) else None


def _accepted(robot: Robot, before: Feasible, after: Feasible, config: RetargetConfig) -> Feasible:
    """Return the motion after a repair, or the one before where the repair broke a hard bar or bent
    it too far."""
    dearest = config.repair.max_added_error_mm + _error_mm(robot, before)
    good = _error_mm(robot, after) <= dearest and _holds(robot, after, config)
    return after if good else before


def _holds(robot: Robot, motion: Feasible, config: RetargetConfig) -> bool:
    """Return whether nothing is too deep in the floor or in another limb, nothing has jumped
    through one, and no hinge is too fast."""
    problem = Problem.of(robot, motion.aims, config.weights)
    broken = faults(problem, motion.qpos, config)
    if bad := broken.deep or broken.fast or broken.jumps:
        _log.debug("repair undone: %s", broken)
    return not bad


def _repaired(robot: Robot, before: Feasible, found: Feasible, config: RetargetConfig) -> Feasible:
    """Raise the weight until enough steps are feasible, fewer are, or the motion would be bent too
    far; not for a motion that is far from feasible."""
    how = config.repair
    dearest = how.max_added_error_mm + _error_mm(robot, before)
    best, good = found, feasible_share(robot, found, config)
    for weight in how.weights[1:]:
        if good >= how.target_share or good < _HOPELESS:
            break
        found = _solved(robot, found, weight, config)
        share = feasible_share(robot, found, config)
        _log.info("weight %g: %.0f %% feasible", weight, 100 * share)
        if share < good or _error_mm(robot, found) > dearest or not _holds(robot, found, config):
            break
        best, good = found, share
    return best


def _error_mm(robot: Robot, motion: Feasible) -> float:
    """Return the mean keypoint error of the clip against the motion's own targets; tails may be
    bent."""
    at = pose(tree(robot), motion.qpos[motion.danced]).site_pos
    aims = motion.aims.keypoints_w[motion.danced]
    return float(keypoint_error_mm(at, aims, robot.keypoint_weights > 0).mean())
