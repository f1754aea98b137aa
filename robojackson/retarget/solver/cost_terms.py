"""The cost of a whole clip: squared residuals in Gauss-Newton form.

sum over frames of  w_k |x_k(q) - target|^2  (keypoints)  +  w_h z^2  (soles on the floor)
+ w_s |J_ground(q) v|^2  (planted soles do not slip)  +  w_p min(0, distance)^2  (floor and self)
+ w_a |a|^2  (tangent accelerations)  +  w_v max(0, |v| - v_max)^2  (hinge speed)
+  w_r |q - rest|^2  (posture).
Metres, radians, seconds; every sum has one term a frame, so that weights hold at any frame rate.
"""

import numpy as np
from jaxtyping import Float, Int

from robojackson.retarget.solver.block_banded import Normal, as_rows
from robojackson.retarget.solver.clip_problem import Problem
from robojackson.retarget.solver.contact_terms import add_balance, add_collisions, add_contacts
from robojackson.retarget.solver.dynamics_term import add_dynamics
from robojackson.robot.tree_kinematics import Posed, point_jacobian

_ROOT_ACCELERATION = np.array([8.0] * 3 + [3.0] * 3)  # m/s2 and rad/s2 beside the hinges' rad/s2


def linearise(problem: Problem, qpos: Float[np.ndarray, "N nq"]) -> Normal:
    """Return the cost of a motion; its gradient and Gauss-Newton blocks are computed when read."""
    out = Normal.empty(len(qpos), qpos.shape[1] - 1)
    posed, touches = problem.detector.detect_posed(problem.tree, qpos)
    velocity = problem.velocity(qpos)
    keypoint_normal(problem, posed, out)
    add_contacts(problem, posed, out)
    add_balance(problem, posed, out)
    add_dynamics(problem, qpos, posed, out)
    add_collisions(problem, posed, touches, out)
    _posture(problem, qpos, out)
    _acceleration(problem, velocity, out)
    _speed(problem, velocity, out)
    return out


def keypoint_normal(
    problem: Problem, posed: Posed, out: Normal, frames: Int[np.ndarray, " N"] | None = None
) -> Float[np.ndarray, " N"]:
    """Add the keypoint term; returns its cost a frame.

    Args:
        frames: Frames whose targets the poses follow; those of the clip in order when None.
    """
    which = slice(None) if frames is None else frames
    weight = np.sqrt(problem.targets.weights[which])
    residual = (posed.site_pos - problem.targets.keypoints_w[which]) * weight[..., None]
    count, unknowns = out.shape

    def rows() -> Float[np.ndarray, "N R nv"]:
        jacobian = point_jacobian(problem.tree, posed, posed.site_pos, problem.tree.site_body)
        jacobian *= weight[..., None, None]
        return np.asarray(jacobian.reshape(count, -1, unknowns))

    out.add_rows(residual.reshape(count, -1), rows)
    return np.asarray(0.5 * np.sum(residual**2, axis=(1, 2)))


def _posture(problem: Problem, qpos: np.ndarray, out: Normal) -> None:
    away = qpos[:, 7:] - problem.robot.rest
    weight = problem.weights.posture
    out.cost += 0.5 * weight * float(np.sum(away**2))

    def add() -> None:
        out.gradient[:, 6:] += weight * away
        _diagonals(out, 0)[:, 6:] += weight

    out.later(add)


def _diagonals(out: Normal, k: int) -> Float[np.ndarray, "N nv"]:
    """Return a view of the diagonals of the blocks (k, t)."""
    frames, unknowns = out.shape
    diagonals: np.ndarray = out.blocks[k].reshape(frames, -1)[:, :: unknowns + 1]
    return diagonals


def _acceleration(problem: Problem, velocity: np.ndarray, out: Normal) -> None:
    """Add second differences, which couple three frames with coefficients 1, -2, 1."""
    dt = problem.targets.dt
    following = np.concatenate([velocity[1:], velocity[:1]]) if problem.ring else velocity[1:]
    acceleration = (following - velocity[: len(following)]) / dt
    weight = np.ones(velocity.shape[1])
    weight[:6] = _ROOT_ACCELERATION
    weight *= problem.weights.acceleration
    out.cost += 0.5 * float(np.sum(weight * acceleration**2))
    out.later(lambda: _add_differences(acceleration, weight, dt, out))


def _add_differences(
    acceleration: Float[np.ndarray, "M nv"],
    weight: Float[np.ndarray, " nv"],
    dt: float,
    out: Normal,
) -> None:
    """Add the derivatives of squared second differences."""
    frames, first = out.shape[0], np.arange(len(acceleration))
    factors = np.array([1.0, -2.0, 1.0]) / dt**2
    for i, a in enumerate(factors):
        rows = as_rows((first + i) % frames)
        out.gradient[rows] += a * weight * acceleration
        for j in range(i, 3):
            _diagonals(out, j - i)[rows] += a * factors[j] * weight


def _speed(problem: Problem, velocity: np.ndarray, out: Normal) -> None:
    """Add a hinge loss on hinge speeds over their share of the limit."""
    limit = problem.weights.speed_share * problem.robot.actuation.motion_speed
    hinges, excess = velocity[:, 6:], np.zeros_like(velocity)
    excess[:, 6:] = np.sign(hinges) * np.maximum(0.0, np.abs(hinges) - limit)
    frame, unknown = np.nonzero(excess)
    if not len(frame):
        return
    weight, dt, over = problem.weights.speed, problem.targets.dt, excess[frame, unknown]
    following = (frame + 1) % out.shape[0]
    out.cost += 0.5 * weight * float(np.sum(over**2))

    def add() -> None:
        np.add.at(out.gradient, (frame, unknown), -weight * over / dt)
        np.add.at(out.gradient, (following, unknown), weight * over / dt)
        np.add.at(out.blocks[0], (frame, unknown, unknown), weight / dt**2)
        np.add.at(out.blocks[0], (following, unknown, unknown), weight / dt**2)
        np.add.at(out.blocks[1], (frame, unknown, unknown), -weight / dt**2)

    out.later(add)
