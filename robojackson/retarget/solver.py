"""Projected Levenberg-Marquardt over a whole clip: hinges never leave their limits.

Active limits are taken out of the system (projected Newton, Bertsekas 1982), the step is clipped to
the limits, and only a step that lowers the cost is kept.
"""

import logging
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from pydantic import ConfigDict, Field
from pydantic.dataclasses import dataclass as config_dataclass

from robojackson.retarget.banded import Chain, Normal
from robojackson.retarget.kinematics import integrate
from robojackson.retarget.problem import Problem
from robojackson.retarget.robot import Robot
from robojackson.retarget.terms import linearise

_log = logging.getLogger(__name__)
_AT_LIMIT = 1e-9
_TRIES = 9


@config_dataclass(frozen=True, config=ConfigDict(extra="forbid"))
class SolverConfig:
    """When the solver stops.

    Attributes:
        iterations: Most Newton steps from each start, at half the control rate.
        polish_iterations: Most Newton steps at the control rate.
        tolerance: Relative decrease of the cost at which it stops.
        largest_turn: Largest change of an angle in one step, radians.
        damping: First Levenberg-Marquardt damping.
    """

    iterations: int = Field(default=40, ge=1)
    polish_iterations: int = Field(default=12, ge=1)
    tolerance: float = Field(default=1e-4, gt=0)
    largest_turn: float = Field(default=0.5, gt=0)
    damping: float = Field(default=1e-3, gt=0)


@dataclass(frozen=True)
class Solution:
    """A motion and its cost."""

    qpos: Float[np.ndarray, "N nq"]
    cost: float
    iterations: int


def solve(
    problem: Problem, start: Float[np.ndarray, "N nq"], config: SolverConfig, iterations: int
) -> Solution:
    """Lower the cost from a start until the decrease is below the tolerance."""
    qpos = clip_to_limits(problem.robot, start)
    chain = Chain(len(qpos), qpos.shape[1] - 1, problem.ring)
    normal, damping, done = linearise(problem, qpos), config.damping, 0
    for done in range(1, iterations + 1):  # noqa: B007
        moved = _descend(problem, chain, qpos, normal, damping, config)
        if moved is None:
            break
        decrease = 1.0 - moved.normal.cost / max(normal.cost, 1e-12)
        qpos, normal, damping = moved.qpos, moved.normal, moved.damping
        if decrease < config.tolerance:
            break
    _log.debug("%d iterations, cost %.5f", done, normal.cost)
    return Solution(qpos, normal.cost, done)


def clip_to_limits(robot: Robot, qpos: Float[np.ndarray, "N nq"]) -> Float[np.ndarray, "N nq"]:
    """The same motion with every hinge inside its limits."""
    out = qpos.copy()
    out[:, 7:] = np.clip(out[:, 7:], robot.lower, robot.upper)
    return out


@dataclass(frozen=True)
class _Accepted:
    qpos: np.ndarray
    normal: Normal
    damping: float


def _descend(
    problem: Problem,
    chain: Chain,
    qpos: np.ndarray,
    normal: Normal,
    damping: float,
    config: SolverConfig,
) -> _Accepted | None:
    """One accepted step, more damped after each failure; None when nothing lowers the cost."""
    free = free_unknowns(problem.robot, qpos, normal.gradient)
    for _ in range(_TRIES):
        try:
            step = chain.step(normal, free, damping)
        except np.linalg.LinAlgError:
            damping *= 10.0
            continue
        step *= min(1.0, config.largest_turn / max(1e-9, float(np.abs(step[:, 3:]).max())))
        trial = clip_to_limits(problem.robot, integrate(qpos, step))
        there = linearise(problem, trial)
        if there.cost < normal.cost:
            return _Accepted(trial, there, max(1e-6, damping / 4.0))
        damping *= 6.0
    return None


def free_unknowns(
    robot: Robot, qpos: Float[np.ndarray, "N nq"], gradient: Float[np.ndarray, "N nv"]
) -> Bool[np.ndarray, "N nv"]:
    """Unknowns that are not pressed against a limit."""
    hinges, push = qpos[:, 7:], gradient[:, 6:]
    held = (hinges <= robot.lower + _AT_LIMIT) & (push > 0)
    held |= (hinges >= robot.upper - _AT_LIMIT) & (push < 0)
    free = np.ones(gradient.shape, bool)
    free[:, 6:] = ~held
    return free
