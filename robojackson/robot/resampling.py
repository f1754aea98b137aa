"""Resample solved poses to a reference motion at the robot's control step.

Hinges and root by cubic spline, the root quaternion by a cubic spline of its components, made unit;
velocities are MuJoCo's tangent differences over two steps. Metres, radians, seconds, world frame.
"""

import numpy as np
from jaxtyping import Float
from scipy.interpolate import CubicSpline

from robojackson.robot.tree_kinematics import continuous, difference


def resample(
    qpos: Float[np.ndarray, "N nq"], steps: Float[np.ndarray, " M"], cycle_offset: np.ndarray | None
) -> Float[np.ndarray, "M nq"]:
    """Return qpos at fractional frame indices; a cycle continues with its first frame, moved by
    `cycle`."""
    rows = continuous(qpos)
    if cycle_offset is None and len(rows) == 1:
        out = np.repeat(rows, len(steps), 0)
    elif cycle_offset is None:
        out = CubicSpline(np.arange(len(rows)), rows)(steps)
    else:
        out = _periodic(rows, steps, cycle_offset)
    out[:, 3:7] /= np.linalg.norm(out[:, 3:7], axis=1, keepdims=True)
    return np.asarray(out)


def _periodic(rows: np.ndarray, steps: np.ndarray, cycle_offset: np.ndarray) -> np.ndarray:
    """Return the periodic spline of what is left when the steady travel of the cycle is taken
    out."""
    count = len(rows)
    travel = np.zeros(rows.shape[1])
    travel[:3] = cycle_offset / count
    last = rows[:1].copy()
    last[:, 3:7] *= np.sign(np.sum(rows[-1, 3:7] * last[0, 3:7]))
    if np.sum(last[0, 3:7] * rows[0, 3:7]) < 0:  # a whole turn: the quaternion comes back negated
        return _padded(rows, steps, cycle_offset)
    flat = np.concatenate([rows - np.arange(count)[:, None] * travel, rows[:1]])
    return np.asarray(CubicSpline(np.arange(count + 1), flat, bc_type="periodic")(steps)) + (
        steps[:, None] * travel
    )


def _padded(rows: np.ndarray, steps: np.ndarray, cycle_offset: np.ndarray) -> np.ndarray:
    pad = min(8, len(rows))
    before, after = rows[-pad:].copy(), rows[:pad].copy()
    before[:, :3] -= cycle_offset
    after[:, :3] += cycle_offset
    joined = continuous(np.concatenate([before, rows, after]))
    joined[:, 3:7] *= np.sign(np.sum(joined[pad, 3:7] * rows[0, 3:7]))
    return np.asarray(CubicSpline(np.arange(-pad, len(rows) + pad), joined)(steps))


def velocities(
    qpos: Float[np.ndarray, "S nq"], dt: float, cycle_offset: np.ndarray | None
) -> Float[np.ndarray, "S nv"]:
    """Return the central tangent differences; one-sided at the ends of a motion that does not
    repeat."""
    steps = forward_velocities(qpos, dt, cycle_offset)
    if cycle_offset is not None:
        return np.asarray((steps + np.roll(steps, 1, axis=0)) / 2)
    inner = (steps[1:] + steps[:-1]) / 2
    return np.concatenate([steps[:1], inner, steps[-1:]])


def forward_velocities(
    qpos: Float[np.ndarray, "S nq"], dt: float, cycle_offset: np.ndarray | None
) -> Float[np.ndarray, "M nv"]:
    """Return the velocities that lead from each step to the next; a cycle has one more than an open
    motion."""
    following = qpos[1:]
    if cycle_offset is not None:
        first = qpos[:1].copy()
        first[:, :3] += cycle_offset
        following = np.concatenate([following, first])
    return difference(qpos[: len(following)], following) / dt


def accelerations(
    qpos: Float[np.ndarray, "S nq"], dt: float, cycle_offset: np.ndarray | None
) -> Float[np.ndarray, "S nv"]:
    """Return second tangent differences; the ends of an open motion repeat their neighbours."""
    steps = forward_velocities(qpos, dt, cycle_offset)
    if cycle_offset is not None:
        return np.asarray((steps - np.roll(steps, 1, axis=0)) / dt)
    inner = np.diff(steps, axis=0) / dt
    return np.concatenate([inner[:1], inner, inner[-1:]])


def seam_angle(qpos: Float[np.ndarray, "S nq"], dt: float, cycle_offset: np.ndarray) -> float:
    """Return the largest angle by which the step over the seam differs from its neighbours' mean,
    degrees."""
    return float(np.degrees(np.abs(_seam_miss(qpos, dt, cycle_offset)[3:]).max()))


def seam_speed(qpos: Float[np.ndarray, "S nq"], dt: float, cycle_offset: np.ndarray) -> float:
    """Return the largest jump of an angular velocity over the seam, rad/s."""
    return float(np.abs(_seam_miss(qpos, dt, cycle_offset)[3:]).max() / dt)


def seam_shift(qpos: Float[np.ndarray, "S nq"], dt: float, cycle_offset: np.ndarray) -> float:
    """Return the difference of the root's step over the seam from its neighbours' mean, metres."""
    return float(np.linalg.norm(_seam_miss(qpos, dt, cycle_offset)[:3]))


def _seam_miss(qpos: np.ndarray, dt: float, cycle_offset: np.ndarray) -> Float[np.ndarray, " nv"]:
    ahead = forward_velocities(qpos, dt, cycle_offset)
    return np.asarray((ahead[-1] - (ahead[-2] + ahead[0]) / 2) * dt)
