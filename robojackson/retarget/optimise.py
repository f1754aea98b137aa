"""The whole-clip solution: two starts, lean, polish at the control rate, and the bars held.

The clip is solved at half the control rate from two starts and the cheaper one is kept; a body that
stays on both feet is leaned over them; the motion is then polished at the control rate, and again
with higher weights where a bar does not hold.
"""

import logging
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from robojackson.metrics.retarget import keypoint_error_mm, slip_cm_s
from robojackson.motion.smpl import PLANTED
from robojackson.retarget.balance import lean, leaned
from robojackson.retarget.config import RetargetConfig
from robojackson.retarget.kinematics import continuous, pose, sole_velocities
from robojackson.retarget.problem import Problem
from robojackson.retarget.resample import resample
from robojackson.retarget.robot import Robot
from robojackson.retarget.solver import Solution, clip_to_limits, solve
from robojackson.retarget.starts import frame_start, rest_start
from robojackson.retarget.targets import Targets, every_second

_log = logging.getLogger(__name__)
_HARDENING_ROUNDS = 3
_LEAN_ROUNDS = 3
_UNTANGLING = 30.0


@dataclass(frozen=True)
class Optimised:
    """A motion, the targets it was solved for, and what was found on the way.

    Attributes:
        qpos: At the control step.
        aims: The targets, leaned where the body had to be.
        lean_deg: How far, degrees.
        faults: The bars that it could not hold.
    """

    qpos: Float[np.ndarray, "S nq"]
    aims: Targets
    lean_deg: float
    faults: "Faults"


def optimise(aims: Targets, robot: Robot, config: RetargetConfig) -> tuple[Optimised, float]:
    """Solve a clip for its targets; a solution that cannot hold the bars gives way to the next.

    Returns the solution and the kinematic floor: the mean keypoint error of every frame by itself,
    without contacts, smoothness or speed limits, millimetres.
    """
    coarse = Problem.of(robot, every_second(aims), config.weights)
    free = frame_start(coarse, np.random.default_rng(config.seed), config.starts)
    tried: list[Optimised] = []
    for solution in _solutions(coarse, free, config):
        tried.append(_finish(coarse, solution, aims, config))
        if not tried[-1].faults.any:
            break
    best = min(tried, key=lambda found: (found.faults.any, found.faults.deepest_m))
    at, wanted = pose(coarse.tree, free).site_pos, coarse.targets.keypoints_w
    floor = keypoint_error_mm(at, wanted, robot.keypoint_weights > 0).mean()
    return best, float(floor)


def _finish(
    coarse: Problem, solution: Solution, aims: Targets, config: RetargetConfig
) -> Optimised:
    """Lean, polish at the control rate, and raise weights until the bars hold."""
    robot = coarse.robot
    shift, upright = _stand_upright(coarse, solution, config)
    fine = Problem.of(robot, leaned(aims, shift), config.weights)
    start = resample(upright.qpos, np.arange(len(aims)) / 2, coarse.targets.lap)
    rough = solve(fine, start, config.solver, config.solver.polish_iterations)
    final = harden(fine, rough, config)
    return Optimised(
        qpos=continuous(clip_to_limits(robot, final.qpos)),
        aims=fine.targets,
        lean_deg=float(np.degrees(np.arctan(np.linalg.norm(shift)))),
        faults=faults(fine, final, config),
    )


def _solutions(
    problem: Problem, free: Float[np.ndarray, "N nq"], config: RetargetConfig
) -> Iterator[Solution]:
    """Coarse solutions, cheapest first; last, one that never lets limbs pass through each other.

    Limbs that have tunnelled stay tangled whatever the weights; from the rest pose, where they are
    free, a strong repulsion keeps them so.
    """
    rest, steps = rest_start(problem), config.solver.iterations
    found = [solve(problem, start, config.solver, steps) for start in (free, rest)]
    _log.info("costs from two starts: %s", ", ".join(f"{s.cost:.4f}" for s in found))
    yield from sorted(found, key=lambda solution: solution.cost)
    strong = replace(
        problem.weights, self_penetration=_UNTANGLING * problem.weights.self_penetration
    )
    yield solve(replace(problem, weights=strong), rest, config.solver, steps)


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
    """Which bars a solution breaks, and by how much."""

    deepest_m: float
    fastest: float
    slip_m_s: float
    deep: bool
    fast: bool
    slips: bool

    @property
    def any(self) -> bool:
        """Whether any bar is broken."""
        return self.deep or self.fast or self.slips


def faults(problem: Problem, solution: Solution, config: RetargetConfig) -> Faults:
    """Measure penetration, hinge speed and slip against the bars."""
    deepest = -float(problem.detector.touches(solution.qpos).distance.min(initial=0.0))
    fastest = float(np.abs(problem.velocity(solution.qpos)[:, 6:]).max())
    slip = _mean_slip(problem, solution.qpos)
    return Faults(
        deepest_m=deepest,
        fastest=fastest,
        slip_m_s=slip,
        deep=deepest > config.depth_bar_m,
        fast=fastest > problem.robot.description.max_joint_speed,
        slips=slip > config.slip_bar_m_s,
    )


def harden(problem: Problem, solution: Solution, config: RetargetConfig) -> Solution:
    """Raise the weights of what is over its bar and solve again, a few rounds at most."""
    for _ in range(_HARDENING_ROUNDS):
        broken = faults(problem, solution, config)
        if not broken.any:
            break
        _log.info("hardening: %s", broken)
        old = problem.weights
        weights = replace(
            old,
            penetration=old.penetration * (4.0 if broken.deep else 1.0),
            self_penetration=old.self_penetration * (4.0 if broken.deep else 1.0),
            speed=old.speed * (4.0 if broken.fast else 1.0),
            slip=old.slip * (4.0 if broken.slips else 1.0),
        )
        problem = replace(problem, weights=weights)
        solution = solve(problem, solution.qpos, config.solver, config.solver.polish_iterations)
    return solution


def _mean_slip(problem: Problem, qpos: np.ndarray) -> float:
    """Mean speed of the soles that are planted in two successive steps, m/s."""
    aims = problem.targets
    posed = pose(problem.tree, qpos)
    speed = sole_velocities(problem.robot, posed, aims.dt, aims.lap)
    slip = slip_cm_s(speed, aims.contact == PLANTED)
    return float(slip.mean()) / 100 if len(slip) else 0.0
