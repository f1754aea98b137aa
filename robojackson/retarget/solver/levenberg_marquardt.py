"""Projected Levenberg-Marquardt over a whole clip: hinges never leave their limits.

Active limits are taken out of the system (projected Newton, Bertsekas 1982), the step is clipped to
the limits, and only a step that lowers the cost is kept.
"""

import logging
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from jaxtyping import Bool, Float
from pydantic import Field

from robojackson.config import config_dataclass
from robojackson.retarget.solver.block_banded import Chain, Normal
from robojackson.retarget.solver.clip_problem import Problem, Warm
from robojackson.retarget.solver.cost_terms import linearise
from robojackson.retarget.targets.keypoint_targets import select_steps
from robojackson.robot.model import Robot
from robojackson.robot.tree_kinematics import integrate

_log = logging.getLogger(__name__)
_AT_LIMIT = 1e-9
_TRIES = 9
_WINDOW = 480  # steps solved at once
_OVERLAP = 24  # steps that a window looks beyond what is kept of it
_HELD = 2  # steps of the window before it that an acceleration reaches back to


@config_dataclass
class SolverConfig:
    """Stopping rules of the solver.

    Attributes:
        iterations: Most Newton steps from each start, at the coarsest rate.
        polish_iterations: Most Newton steps at each finer rate.
        tolerance: Relative decrease of the cost at which the control rate stops.
        rough_tolerance: Relative decrease of the cost at which the coarser rates stop.
        largest_turn: Largest change of an angle in one step, radians.
        damping: First Levenberg-Marquardt damping, unitless.
    """

    iterations: int = Field(default=40, ge=1)
    polish_iterations: int = Field(default=12, ge=1)
    tolerance: float = Field(default=1e-3, gt=0)
    rough_tolerance: float = Field(default=5e-3, gt=0)
    largest_turn: float = Field(default=0.5, gt=0)
    damping: float = Field(default=1e-3, gt=0)


@dataclass(frozen=True)
class Solution:
    """A motion and its cost; windows overlap, so the cost serves to compare solutions only."""

    qpos: Float[np.ndarray, "N nq"]
    cost: float


def solve(
    problem: Problem,
    start: Float[np.ndarray, "N nq"],
    config: SolverConfig,
    iterations: int,
    tolerance: float | None = None,
    spans: Sequence[slice] | None = None,
) -> Solution:
    """Return a lower-cost motion, iterated from a start until the decrease is below the tolerance.

    A long clip is solved window after window, so that time is linear in its length and memory does
    not grow with it: each window begins in the poses that the one before it found and looks beyond
    the end of what is kept of it.

    Args:
        tolerance: Stopping tolerance; that of the configuration when None.
        spans: The steps that may change, of a clip that does not repeat; all when None.
    """
    stop_at = config.tolerance if tolerance is None else tolerance
    qpos = clip_to_limits(problem.robot, start)
    cost = 0.0
    for window in _windows(len(qpos), None if problem.ring else spans, problem.ring):
        part = replace(problem, targets=select_steps(problem.targets, window.all), warm=Warm())
        found = _solve_window(part, qpos[window.all], config, iterations, stop_at, window)
        qpos[window.all] = found.qpos
        cost += found.normal.cost
        _log.debug("steps %d-%d, cost %.5f", window.all.start, window.all.stop, found.normal.cost)
    return Solution(qpos, cost)


@dataclass(frozen=True)
class _Window:
    """Steps that are solved at once; those beside the free ones are held."""

    all: slice
    free: slice

    def held(self) -> Bool[np.ndarray, " N"]:
        """Return which of its steps stay as they are."""
        step = np.arange(self.all.start, self.all.stop)
        result: np.ndarray = (step < self.free.start) | (step >= self.free.stop)
        return result


def _windows(frames: int, spans: Sequence[slice] | None, ring: bool) -> Iterator[_Window]:
    """Yield the windows of about the same length that overlap, in each span."""
    if ring:
        yield _Window(slice(0, frames), slice(0, frames))
        return
    for span in [slice(0, frames)] if spans is None else spans:
        length = span.stop - span.start
        count = max(1, -(-(length - _OVERLAP) // (_WINDOW - _OVERLAP)))
        edges = np.linspace(span.start, span.stop - _OVERLAP, count + 1).astype(int)
        for start, end in pairwise(edges):
            first = max(start - _HELD, 0) if start == span.start else start
            stop = end + _OVERLAP if end < edges[-1] else span.stop
            last = stop if stop < span.stop else min(stop + _HELD, frames)
            free = start if start == span.start else start + _HELD
            yield _Window(slice(int(first), int(last)), slice(int(free), int(stop)))


def _solve_window(
    problem: Problem,
    qpos: Float[np.ndarray, "N nq"],
    config: SolverConfig,
    iterations: int,
    tolerance: float,
    window: _Window,
) -> "_State":
    held = window.held()
    chain = Chain(len(qpos), qpos.shape[1] - 1, problem.ring)
    state = _State(qpos, linearise(problem, qpos), config.damping)
    for _ in range(iterations):
        moved = _descend(problem, chain, state, config, held)
        if moved is None:
            break
        decrease = 1.0 - moved.normal.cost / max(state.normal.cost, 1e-12)
        state = moved
        if decrease < tolerance:
            break
    return state


def clip_to_limits(robot: Robot, qpos: Float[np.ndarray, "N nq"]) -> Float[np.ndarray, "N nq"]:
    """Return the same motion with every hinge inside its limits."""
    out = qpos.copy()
    out[:, 7:] = np.clip(out[:, 7:], robot.lower, robot.upper)
    return out


@dataclass(frozen=True)
class _State:
    """A motion, its normal equations, and how much the next step is damped."""

    qpos: np.ndarray
    normal: Normal
    damping: float


def _descend(
    problem: Problem, chain: Chain, state: _State, config: SolverConfig, held: np.ndarray
) -> _State | None:
    """Return one accepted step, more damped after each failure; None when nothing lowers the cost.

    The damping follows how much of the predicted decrease came true (Nielsen 1999).
    """
    normal, damping, growth = state.normal, state.damping, 4.0
    free = free_unknowns(problem.robot, state.qpos, normal.gradient)
    free[held] = False
    for _ in range(_TRIES):
        try:
            step = chain.step(normal, free, damping)
        except np.linalg.LinAlgError:
            damping *= 10.0
            continue
        share = min(1.0, config.largest_turn / max(1e-9, float(np.abs(step[:, 3:]).max())))
        trial = clip_to_limits(problem.robot, integrate(state.qpos, share * step))
        there = linearise(problem, trial)
        if there.cost < normal.cost:
            promised = share * (1 - share / 2) * -float(np.sum(normal.gradient * step * free))
            kept = (normal.cost - there.cost) / max(promised, 1e-12)
            factor = max(0.2, 1.0 - (2.0 * min(kept, 1.0) - 1.0) ** 3)
            return _State(trial, there, max(1e-6, damping * factor))
        damping *= growth
        growth *= 2.0
    return None


def free_unknowns(
    robot: Robot, qpos: Float[np.ndarray, "N nq"], gradient: Float[np.ndarray, "N nv"]
) -> Bool[np.ndarray, "N nv"]:
    """Return the unknowns that are not pressed against a limit."""
    hinges, push = qpos[:, 7:], gradient[:, 6:]
    held = (hinges <= robot.lower + _AT_LIMIT) & (push > 0)
    held |= (hinges >= robot.upper - _AT_LIMIT) & (push < 0)
    free = np.ones(gradient.shape, bool)
    free[:, 6:] = ~held
    return free
