"""The dynamics term of the cost: what neither soles nor motors can give costs its square.

The value of `contact_wrench.relaxed` at F(q_t, v_t, a_t) - G(q_t) p_t: pushes and torques follow
every change of the motion. F by finite differences of MuJoCo's inverse dynamics, with v and a the
differences of three steps. Cauchy's loss: a step that no repair can save must not bend the motion.
"""

from dataclasses import dataclass

import mujoco
import numpy as np
from jaxtyping import Float
from scipy.special import expit

from robojackson.motion.smpl_sequence import AIR
from robojackson.retarget.feasibility import contact_wrench, inverse_dynamics
from robojackson.retarget.solver.block_banded import Normal
from robojackson.retarget.solver.clip_problem import Problem, Weights
from robojackson.robot.resampling import accelerations, velocities
from robojackson.robot.tree_kinematics import Posed, point_jacobian

_NUDGE = 1e-6
_SOFTNESS = 0.15  # of the corner of the hinge, squared tolerances


@dataclass(frozen=True)
class Slopes:
    """Derivatives of the force of inverse dynamics, one matrix a step."""

    force: Float[np.ndarray, "N nv"]
    position: Float[np.ndarray, "N nv nv"]
    velocity: Float[np.ndarray, "N nv nv"]
    acceleration: Float[np.ndarray, "N nv nv"]


def add_dynamics(
    problem: Problem, qpos: Float[np.ndarray, "N nq"], posed: Posed, out: Normal
) -> None:
    """Add what no contact and no motor can give, of every step that has two neighbours."""
    if problem.weights.dynamics == 0.0:
        return
    dt, cycle_offset = problem.targets.dt, problem.targets.cycle_offset
    inner = np.arange(len(qpos)) if problem.ring else np.arange(1, len(qpos) - 1)
    speed, rate = (
        velocities(qpos, dt, cycle_offset)[inner],
        accelerations(qpos, dt, cycle_offset)[inner],
    )
    model = inverse_dynamics.unconstrained(problem.robot)
    slopes = inverse_slopes(model, qpos[inner], speed, rate)
    touching = problem.targets.contact[inner] != AIR
    asked = inverse_dynamics.demand(
        problem.robot, qpos[inner], slopes.force, touching, problem.weights.tolerance
    )
    found = contact_wrench.relaxed(asked, problem.weights.dynamics_barrier)
    loss = _loss(problem.weights, found.value)
    grip, bend = np.sqrt(loss.slope), np.sqrt(loss.bend)
    root = np.concatenate(
        [grip[:, None, None] * found.root, (bend[:, None] * found.slope)[:, None]], axis=1
    )
    residual = np.concatenate([grip[:, None] * found.residual, np.zeros((len(inner), 1))], axis=1)
    at = posed[inner]
    here = slopes.position - 2 / dt**2 * slopes.acceleration
    here -= pushed_slopes(problem, at, found.pushes)
    aside, turn = slopes.acceleration / dt**2, slopes.velocity / (2 * dt)
    rows = (root @ (aside - turn), root @ here, root @ (aside + turn))
    out.cost += loss.cost - 0.5 * float(np.sum(residual**2))
    out.add_chained(residual, rows, (inner - 1) % len(qpos))


def inverse_slopes(
    model: mujoco.MjModel, qpos: np.ndarray, speed: np.ndarray, rate: np.ndarray
) -> Slopes:
    """The force and its derivatives in the tangent space of each step."""
    data, count = mujoco.MjData(model), speed.shape[1]
    force = np.empty_like(speed)
    matrices = np.empty((3, len(qpos), count, count))
    for step in range(len(qpos)):
        data.qpos[:], data.qvel[:], data.qacc[:] = qpos[step], speed[step], rate[step]
        mujoco.mj_inverse(model, data)
        force[step] = data.qfrc_inverse
        p, v, a = matrices[:, step]
        mujoco.mjd_inverseFD(model, data, _NUDGE, False, p, v, a, None, None, None, None)
    p, v, a = matrices.swapaxes(2, 3)
    return Slopes(force, p, v, a)


def pushed_slopes(
    problem: Problem, posed: Posed, pushes: Float[np.ndarray, "N E"]
) -> Float[np.ndarray, "N nv nv"]:
    """Derivative of the generalised force of fixed pushes, d(J^T f)/dq.

    Turning dof k moves everything that hangs below it: d J_j / d q_k = a_k x J_j where k is above
    j, and a_j x J_k where j is above k. The lowest point of a ball stays behind what is fixed to it
    by r a_k x z.
    """
    robot, tree = problem.robot, problem.tree
    points = inverse_dynamics.sole_points(robot, posed)
    jacobian = point_jacobian(tree, posed, points, robot.contact_bodies)
    edges = inverse_dynamics.directions() * inverse_dynamics.body_weight(robot)
    force = pushes.reshape(*points.shape[:2], -1) @ edges.T
    axes = np.concatenate([posed.body_rot[:, tree.root].swapaxes(1, 2), posed.axis], axis=1)
    out = np.zeros((len(points), *[jacobian.shape[-1]] * 2))
    for contact, body in enumerate(robot.contact_bodies):
        moved = axes * np.concatenate([np.ones(3), tree.moves[body]])[:, None]
        push = force[:, contact, None]
        lever = np.cross(push, moved)  # f . (a_k x J_j) = J_j . (f x a_k)
        turned = _symmetric(jacobian[:, contact, :, 3:].swapaxes(1, 2) @ lever.swapaxes(1, 2))
        behind = robot.contact_radii[contact] * np.cross(moved, [0.0, 0.0, 1.0])
        out[:, 3:, 3:] += turned + moved @ np.cross(behind, push).swapaxes(1, 2)
    return out


def _symmetric(slopes: np.ndarray) -> np.ndarray:
    """Rows j, columns k: where j is above k, the mirrored entry counts; MuJoCo's dofs run down."""
    lower = np.tril(slopes)
    out = lower + np.tril(slopes, -1).swapaxes(1, 2)
    out[:, :3, :3] = slopes[:, :3, :3]
    return np.asarray(out)


@dataclass(frozen=True)
class _Loss:
    """Cauchy's loss of what is beyond the margin: cost, slope and curvature in the value."""

    cost: float
    slope: Float[np.ndarray, " N"]
    bend: Float[np.ndarray, " N"]


def _loss(weights: Weights, value: Float[np.ndarray, " N"]) -> _Loss:
    over = (2 * value - weights.dynamics_margin**2) / _SOFTNESS
    active = expit(over)
    beyond = _SOFTNESS * np.logaddexp(0.0, over)
    reach = weights.dynamics_reach**2
    grip = weights.dynamics / (1.0 + beyond / reach)
    cost = 0.5 * weights.dynamics * float(np.sum(reach * np.log1p(beyond / reach)))
    return _Loss(cost, grip * active, grip * active * (1.0 - active) * 2.0 / _SOFTNESS)
