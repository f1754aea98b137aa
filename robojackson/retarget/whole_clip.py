"""The whole-clip solution: two starts, lean, polish at the control rate, and the bars held.

The clip is solved at half the control rate from two starts and the cheaper one is kept; a body that
stays on both feet is leaned over them; the motion is then polished at the control rate, and again
with higher weights where a bar does not hold.
"""

import logging
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from robojackson.metrics.retarget_error import slip_cm_s
from robojackson.motion.smpl_sequence import PLANTED
from robojackson.retarget.retarget_config import RetargetConfig
from robojackson.retarget.solver.balance import lean, leaned
from robojackson.retarget.solver.clip_problem import Problem
from robojackson.retarget.solver.collision import Detector
from robojackson.retarget.solver.initial_poses import frame_start, rest_start
from robojackson.retarget.solver.levenberg_marquardt import Solution, clip_to_limits, solve
from robojackson.retarget.targets.keypoint_targets import Targets, every_second
from robojackson.robot.model import Robot
from robojackson.robot.resampling import resample
from robojackson.robot.tree_kinematics import Posed, continuous, pose, sole_velocities

_log = logging.getLogger(__name__)
_HARDENING_ROUNDS = 3
_LEAN_ROUNDS = 3
_UNTANGLING = 30.0
_FAST_SLIP = 3.5  # the 95th percentile of slip may be so many times its mean's bar
_OWN_ACCELERATION = 2.0  # a motion may have so many times its targets'
_SKETCHED = 60  # steps from which a clip is solved at a quarter of the control rate first


@dataclass(frozen=True)
class Optimised:
    """A motion, the targets it was solved for, and what was found on the way.

    Attributes:
        qpos: At the control step.
        aims: The targets, leaned where the body is leaned.
        shift: How far at one metre of height, forward and left.
        faults: The bars that it could not hold.
    """

    qpos: Float[np.ndarray, "S nq"]
    aims: Targets
    shift: Float[np.ndarray, "2"]
    faults: "Faults"

    @property
    def lean_deg(self) -> float:
        """How far it is leaned, degrees."""
        return float(np.degrees(np.arctan(np.linalg.norm(self.shift))))


def optimise(aims: Targets, robot: Robot, config: RetargetConfig) -> tuple[Optimised, float]:
    """Solve a clip for its targets; a solution that misses the bars is replaced by the next.

    Returns the solution and the kinematic floor: the mean keypoint error of every frame by itself,
    without contacts, smoothness or speed limits, millimetres.
    """
    coarse = Problem.of(robot, every_second(aims), config.weights)
    sketch = _sketch(coarse)
    free = frame_start(sketch, np.random.default_rng(config.seed), config.starts)
    tried: list[Optimised] = []
    for drawn in _solutions(sketch, free.qpos, config):
        solution = drawn if sketch is coarse else _refined(coarse, drawn, config)
        tried.append(_finish(coarse, solution, aims, config))
        if not tried[-1].faults.any:
            break
    best = min(tried, key=lambda found: (found.faults.any, found.faults.deepest_m))
    return best, free.floor_mm


def _sketch(coarse: Problem) -> Problem:
    """Return the clip at a quarter of the control rate, where that leaves enough steps."""
    count = len(coarse.targets)
    if count < _SKETCHED or (coarse.ring and count % 2):
        return coarse
    return Problem.of(coarse.robot, every_second(coarse.targets), coarse.weights)


def _refined(coarse: Problem, drawn: Solution, config: RetargetConfig) -> Solution:
    """Return a sketch at twice its rate."""
    start = resample(drawn.qpos, np.arange(len(coarse.targets)) / 2, coarse.targets.cycle_offset)
    how = config.solver
    return solve(coarse, start, how, how.polish_iterations, how.rough_tolerance)


def _finish(
    coarse: Problem, solution: Solution, aims: Targets, config: RetargetConfig
) -> Optimised:
    """Lean, polish at the control rate, and raise weights until the bars hold."""
    shift, upright = _stand_upright(coarse, solution, config)
    start = resample(upright.qpos, np.arange(len(aims)) / 2, coarse.targets.cycle_offset)
    return polished(aims, start, shift, coarse.robot, config)


def polished(
    aims: Targets,
    start: Float[np.ndarray, "S nq"],
    shift: Float[np.ndarray, "2"],
    robot: Robot,
    config: RetargetConfig,
) -> Optimised:
    """Solve at the control rate from a start, and raise weights until the bars hold."""
    fine = Problem.of(robot, leaned(aims, shift), config.weights)
    rough = solve(fine, start, config.solver, config.solver.polish_iterations)
    final = harden(fine, rough, config)
    return Optimised(
        qpos=continuous(clip_to_limits(robot, final.qpos)),
        aims=fine.targets,
        shift=shift,
        faults=faults(fine, final.qpos, config),
    )


def _solutions(
    problem: Problem, free: Float[np.ndarray, "N nq"], config: RetargetConfig
) -> Iterator[Solution]:
    """Yield the coarse solutions, cheapest first; last, one that never lets limbs pass through each
    other.

    Limbs that have tunnelled stay tangled with any weights; from the rest pose, where they are
    free, a strong repulsion keeps them so.
    """
    rest, how = rest_start(problem), config.solver
    rough = (how, how.iterations, how.rough_tolerance)
    found = [solve(problem, start, *rough) for start in (free, rest)]
    _log.info("costs from two starts: %s", ", ".join(f"{s.cost:.4f}" for s in found))
    yield from sorted(found, key=lambda solution: solution.cost)
    strong = replace(
        problem.weights, self_penetration=_UNTANGLING * problem.weights.self_penetration
    )
    yield solve(replace(problem, weights=strong), rest, *rough)


def _stand_upright(
    problem: Problem, solution: Solution, config: RetargetConfig
) -> tuple[Float[np.ndarray, "2"], Solution]:
    """Lean a body that stays on both feet over them; others keep their balance by moving."""
    shift, upright = np.zeros(2), problem.targets
    if (upright.contact == PLANTED).all(axis=1).mean() < config.stands_share:
        return shift, solution
    largest = np.tan(np.radians(config.lean_deg))
    for _ in range(_LEAN_ROUNDS):
        shift = shift + lean(problem, solution.qpos)
        shift *= min(1.0, largest / max(float(np.linalg.norm(shift)), 1e-9))
        problem = replace(problem, targets=leaned(upright, shift))
        solution = solve(problem, solution.qpos, config.solver, config.solver.iterations)
    return shift, solution


@dataclass(frozen=True)
class Faults:
    """The bars that a solution breaks, and by how much."""

    deepest_m: float
    fastest: float
    slip_m_s: float
    acceleration_m_s2: float
    deep: bool
    fast: bool
    slips: bool
    jumps: bool

    @property
    def any(self) -> bool:
        """Whether any bar is broken."""
        return self.heavier_weights_help or self.jumps

    @property
    def heavier_weights_help(self) -> bool:
        """Whether one is broken other than by a limb that has jumped through another."""
        return self.deep or self.fast or self.slips


def faults(problem: Problem, qpos: Float[np.ndarray, "T nq"], config: RetargetConfig) -> Faults:
    """Measure penetration, hinge speed, slip and accelerations against the bars."""
    touches = Detector(problem.robot, 0.0).touches(qpos)
    deepest = -float(touches.distance.min(initial=0.0))
    speeds = np.abs(problem.velocity(qpos)[:, 6:])
    posed, aims = pose(problem.tree, qpos), problem.targets
    slip, fast_slip = _slip(problem, posed)
    found, required = (_acceleration(p, aims) for p in (posed.site_pos, aims.keypoints_w))
    return Faults(
        deepest_m=deepest,
        fastest=float(speeds.max()),
        slip_m_s=slip,
        acceleration_m_s2=found,
        jumps=found > max(config.jump_bar_m_s2, _OWN_ACCELERATION * required),
        deep=deepest > config.depth_bar_m,
        fast=bool((speeds > problem.robot.actuation.motion_speed).any()),
        slips=slip > config.slip_bar_m_s or fast_slip > _FAST_SLIP * config.slip_bar_m_s,
    )


def harden(
    problem: Problem,
    solution: Solution,
    config: RetargetConfig,
    spans: Sequence[slice] | None = None,
) -> Solution:
    """Raise the weights of what is over its bar and solve again, a few rounds at most.

    Args:
        spans: The steps that may change; all when None.
    """
    for _ in range(_HARDENING_ROUNDS):
        broken = faults(problem, solution.qpos, config)
        if not broken.heavier_weights_help:
            break
        _log.debug("hardening: %s", broken)
        old = problem.weights
        weights = replace(
            old,
            penetration=old.penetration * (4.0 if broken.deep else 1.0),
            self_penetration=old.self_penetration * (4.0 if broken.deep else 1.0),
            speed=old.speed * (4.0 if broken.fast else 1.0),
            slip=old.slip * (4.0 if broken.slips else 1.0),
        )
        problem = replace(problem, weights=weights)
        iterations = config.solver.polish_iterations
        solution = solve(problem, solution.qpos, config.solver, iterations, spans=spans)
    return solution


def _acceleration(points: Float[np.ndarray, "T K 3"], aims: Targets) -> float:
    """Return the largest acceleration of a keypoint, m/s2, over a cycle's seam as well: a limb that
    has come out on another's far side has passed through it between two steps."""
    if aims.cycle_offset is not None:
        points = np.concatenate([points, points[:2] + aims.cycle_offset])
    change = np.linalg.norm(np.diff(points, 2, axis=0), axis=-1) / aims.dt**2
    return float(change.max(initial=0.0))


def _slip(problem: Problem, posed: Posed) -> tuple[float, float]:
    """Return the speed of the soles that are planted in two successive steps: mean, 95th
    percentile, m/s, of the clip or of its tails, whichever is more."""
    aims = problem.targets
    speed = sole_velocities(problem.robot, posed, aims.dt, aims.cycle_offset)
    planted = aims.contact == PLANTED
    danced = np.ones(len(planted), bool) if aims.danced is None else aims.danced
    parts = (slip_cm_s(speed, planted & some[:, None]) / 100 for some in (danced, ~danced))
    slips = [part for part in parts if len(part)] or [np.zeros(1)]
    means, fastest = zip(*((slip.mean(), np.quantile(slip, 0.95)) for slip in slips), strict=True)
    return float(max(means)), float(max(fastest))
