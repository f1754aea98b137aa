"""Tempo: slow a motion down where that lets the robot do it, smoothly, and nowhere else.

Slowing down divides inertial forces by the square of the factor and leaves gravity as it is: it
helps a limb that is too heavy to be swung so fast, and not a body that stands beside its foot. The
warp is a monotone map from steps of the slower motion to fractional steps of the given one, with a
smooth rate between `slowest` and 1. The control step stays what it is.
"""

from dataclasses import replace

import numpy as np
from jaxtyping import Float
from scipy.interpolate import CubicSpline
from scipy.ndimage import gaussian_filter1d, minimum_filter1d

from robojackson.retarget.feasibility import contact_wrench, inverse_dynamics
from robojackson.retarget.feasibility.contact_wrench import Demand, Tolerance
from robojackson.retarget.feasibility.inverse_dynamics import FreeSpace
from robojackson.retarget.targets.keypoint_targets import Targets, select_steps
from robojackson.robot.model import Robot
from robojackson.robot.tree_kinematics import pose

GRID = np.array([1.0, 0.9, 0.8, 0.7, 0.6, 0.5])
"""Tempos that are tried, beside the motion's own."""
_HELPS = 0.7  # a slower tempo that does not make a step feasible must leave this share of the slack
_NEARLY = 1.0  # slack up to which a tempo will do; the next repair could take away a little more
_REACH_S = 0.1  # a slow step slows its neighbours down so far
_SMOOTH_S = 0.15  # standard deviation of the smoothing of the rate


def slacks(
    robot: Robot,
    qpos: Float[np.ndarray, "S nq"],
    dt: float,
    cycle_offset: np.ndarray | None,
    tolerance: Tolerance,
    grid: Float[np.ndarray, " K"] = GRID,
    known: Float[np.ndarray, " S"] | None = None,
) -> Float[np.ndarray, "K S"]:
    """Return the slack at every tempo of the grid, in tolerances.

    A step that is feasible at the first one is tried at no other.

    Args:
        known: The slack at the first tempo, where it has been computed.
    """
    forces = inverse_dynamics.free_space(robot, qpos, dt, cycle_offset)
    posed = pose(inverse_dynamics.linkage(robot), qpos)
    near = inverse_dynamics.touching(robot, posed)
    needs = inverse_dynamics.demand(robot, qpos, forces.at(grid[0]), near, tolerance, posed)
    slack = contact_wrench.supply(needs).slack if known is None else known
    return slower_slacks(needs, forces, slack, grid)


def slower_slacks(
    needs: Demand,
    forces: FreeSpace,
    slack: Float[np.ndarray, " S"],
    grid: Float[np.ndarray, " K"] = GRID,
) -> Float[np.ndarray, "K S"]:
    """Return the slack at every tempo of the grid, given it at the first."""
    found = np.repeat(slack[None], len(grid), axis=0)
    hard = np.flatnonzero(slack > 1.0)
    if len(hard):
        some = needs.at(hard)
        for row, k in zip(found[1:], grid[1:], strict=True):
            row[hard] = contact_wrench.supply(replace(some, force=forces.at(k)[hard])).slack
    return found


def feasible_tempo(slack: Float[np.ndarray, "K S"], within: float = 1.0) -> Float[np.ndarray, " S"]:
    """Return the fastest tempo of the grid at which each step is feasible; 0 where none is."""
    fits = slack <= within
    return np.where(fits.any(axis=0), GRID[fits.argmax(axis=0)], 0.0)


def required_rate(slack: Float[np.ndarray, "K S"]) -> Float[np.ndarray, " S"]:
    """Return the tempo that each step needs: 1 where slowing down does not help.

    A step that no tempo makes feasible is slowed to the best one, where that is much better.
    """
    fits = feasible_tempo(slack, _NEARLY)
    best = slack.argmin(axis=0)
    lowest = np.take_along_axis(slack, best[None], axis=0)[0]
    partly = np.where(lowest < _HELPS * slack[0], GRID[best], 1.0)
    return np.where(fits > 0, fits, partly)


def smooth_rate(rates: Float[np.ndarray, " S"], dt: float, ring: bool) -> Float[np.ndarray, " S"]:
    """Return the target tempos, spread over their neighbours and smoothed; never faster than 1."""
    mode = "wrap" if ring else "nearest"
    spread = minimum_filter1d(rates, 2 * round(_REACH_S / dt) + 1, mode=mode)
    return np.asarray(gaussian_filter1d(spread, _SMOOTH_S / dt, mode=mode))


def warp(rate: Float[np.ndarray, " S"], ring: bool) -> Float[np.ndarray, " M"]:
    """Return the fractional steps of the given motion that the steps of the slower one show.

    The step s is passed at the time t with dt/ds = 1 / rate(s); t is stretched by less than a step
    so that the motion ends with a whole one.
    """
    pace = 1.0 / np.append(rate, rate[0]) if ring else 1.0 / rate
    time = np.concatenate([[0.0], np.cumsum((pace[1:] + pace[:-1]) / 2)])
    count = int(np.ceil(time[-1] - 1e-9))
    steps = np.interp(np.arange(count + 1) * time[-1] / count, time, np.arange(len(time)))
    result: np.ndarray = steps[:-1] if ring else steps
    return result


def warped(aims: Targets, steps: Float[np.ndarray, " M"]) -> Targets:
    """Return the targets at fractional steps."""
    nearest = np.round(steps).astype(int) % len(aims)
    points = _between(aims.keypoints_w, steps, aims.cycle_offset)
    return replace(select_steps(aims, nearest), keypoints_w=points)


def times_at(
    time_s: Float[np.ndarray, " S"], steps: Float[np.ndarray, " M"]
) -> Float[np.ndarray, " M"]:
    """Return the times in the source clip at fractional steps; the last step is as long as the one
    before."""
    following = np.append(time_s, 2 * time_s[-1] - time_s[-2])
    result: np.ndarray = np.interp(steps, np.arange(len(following)), following)
    return result


def _between(
    points: Float[np.ndarray, "S K 3"], steps: np.ndarray, cycle_offset: np.ndarray | None
) -> Float[np.ndarray, "M K 3"]:
    count = len(points)
    if cycle_offset is None:
        return np.asarray(CubicSpline(np.arange(count), points)(steps))
    travel = cycle_offset / count
    flat = points - np.arange(count)[:, None, None] * travel
    spline = CubicSpline(np.arange(count + 1), np.concatenate([flat, flat[:1]]), bc_type="periodic")
    return np.asarray(spline(steps) + steps[:, None, None] * travel)
