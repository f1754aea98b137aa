"""The dynamics term of the cost: what neither soles nor motors can give costs its square.

The value of `contact_wrench.relaxed` at F(q_t, v_t, a_t) - G(q_t) p_t: pushes and torques follow
every change of the motion. F and its derivatives by `rigid_dynamics`, with v and a the differences
of three steps. Cauchy's loss: a step that no repair can save must not bend the motion.
"""

from dataclasses import dataclass

import mujoco
import numpy as np
from jaxtyping import Float
from scipy.special import expit

from robojackson.motion.smpl_sequence import AIR
from robojackson.retarget.feasibility import contact_wrench, inverse_dynamics
from robojackson.retarget.feasibility.contact_wrench import Relaxed
from robojackson.retarget.feasibility.force_model import force_model, once_a_robot, unconstrained
from robojackson.retarget.feasibility.rigid_dynamics import Dynamics, Slopes, dynamics
from robojackson.retarget.solver.block_banded import Normal
from robojackson.retarget.solver.clip_problem import Problem, Weights
from robojackson.robot.model import Robot
from robojackson.robot.resampling import accelerations, velocities
from robojackson.robot.tree_kinematics import Posed, pose

_NUDGE = 1e-6
_PROBES = 3
_CHUNK = 16  # steps whose matrices stay in the cache
_SOFTNESS = 0.15  # of the corner of the hinge, squared tolerances


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
    at = posed[inner]
    forces = _dynamics(problem, at, qpos[inner], speed, rate)
    touching = problem.targets.contact[inner] != AIR
    needs = inverse_dynamics.demand(
        problem.robot, qpos[inner], forces.force, touching, problem.weights.tolerance, at
    )
    found = contact_wrench.relaxed(needs, problem.weights.dynamics_barrier, problem.warm.point)
    problem.warm.point = found.point
    loss = _loss(problem.weights, found.value)
    out.cost += loss.cost
    out.later(lambda: _add_slopes(problem, at, forces.slopes(), found, loss, out))


def _add_slopes(
    problem: Problem, at: Posed, force: Slopes, found: Relaxed, loss: "_Loss", out: Normal
) -> None:
    """Add gradient and curvature, a few steps at a time.

    The last steps come first: then every frame adds its terms in the order in which all steps at
    once would, and the sums are the same to the last bit.
    """
    dt, count = problem.targets.dt, len(force.force)
    here = force.position - 2 / dt**2 * force.acceleration
    _take_pushes(problem, at, found.pushes, here)
    root, firsts = found.root(), np.arange(count)
    if problem.ring:
        firsts = (firsts - 1) % count
    part = count if problem.ring else _CHUNK
    for start in range((count - 1) // part * part, -1, -part):
        steps = slice(start, min(start + part, count))
        aside, turn = force.acceleration[steps] / dt**2, force.velocity[steps] / (2 * dt)
        columns = np.concatenate([aside - turn, here[steps], aside + turn], axis=2)
        gradient = (found.slope[steps, None] @ columns)[:, 0]
        rows = np.empty((len(columns), columns.shape[1] + 1, columns.shape[2]))
        rows[:, :-1] = root.at(steps) @ columns
        rows[:, :-1] *= np.sqrt(loss.slope[steps])[:, None, None]
        rows[:, -1] = np.sqrt(loss.bend[steps])[:, None] * gradient
        out.add_square(loss.slope[steps, None] * gradient, rows, firsts[steps])


def _dynamics(
    problem: Problem, posed: Posed, qpos: np.ndarray, speed: np.ndarray, rate: np.ndarray
) -> "Dynamics | _Differences":
    """Return the force, and its derivatives in the tangent space of each step: analytic where the
    model has nothing but rigid bodies, springs and damping, by finite differences of MuJoCo's
    otherwise.
    """
    robot = problem.robot
    if rigid(robot):
        return dynamics(force_model(robot), posed, qpos[:, 7:], speed, rate)
    return _Differences(inverse_slopes(unconstrained(robot), qpos, speed, rate))


@dataclass(frozen=True)
class _Differences:
    """Inverse dynamics whose derivatives come with the force."""

    found: Slopes

    @property
    def force(self) -> Float[np.ndarray, "N nv"]:
        """Force in free space."""
        return self.found.force

    def slopes(self) -> Slopes:
        """Return the force and its derivatives."""
        return self.found


@once_a_robot
def rigid(robot: Robot) -> bool:
    """Return whether the analytic force is MuJoCo's: a model may have fluid, tendons or dry
    friction."""
    rng = np.random.default_rng(0)
    qpos = np.tile(robot.standing, (_PROBES, 1))
    qpos[:, 7:] = rng.uniform(robot.lower, robot.upper, (_PROBES, len(robot.lower)))
    speed, rate = rng.normal(size=(2, _PROBES, robot.model.nv))
    expected = inverse_dynamics.inverse(unconstrained(robot), qpos, speed, rate)
    at = pose(inverse_dynamics.linkage(robot), qpos)
    found = dynamics(force_model(robot), at, qpos[:, 7:], speed, rate).force
    return bool(np.allclose(found, expected, rtol=1e-6, atol=1e-6))


def inverse_slopes(
    model: mujoco.MjModel, qpos: np.ndarray, speed: np.ndarray, rate: np.ndarray
) -> Slopes:
    """Return the same by finite differences."""
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


def _take_pushes(
    problem: Problem,
    posed: Posed,
    pushes: Float[np.ndarray, "N E"],
    slopes: Float[np.ndarray, "N nv nv"],
) -> None:
    """Subtract the derivative of the generalised force of fixed pushes, d(J^T f)/dq.

    Only the dofs above a foot count. With W the wrench of a foot's pushes about the origin and i
    above j, or j itself, dS_j = S_i x S_j turns it by -S_j . (S_i x* W); and any i takes the points
    where the pushes act along by v_i(centre of the ball), which adds v_i x f to the moment.
    """
    robot, tree = problem.robot, problem.tree
    points = inverse_dynamics.sole_points(robot, posed)
    edges = inverse_dynamics.directions(robot) * inverse_dynamics.body_weight(robot)
    force = np.einsum("cxe,nce->ncx", edges, pushes.reshape(*points.shape[:2], -1))
    model, (axis, moment) = force_model(robot), posed.screws
    for body in np.unique(robot.contact_bodies):
        own = robot.contact_bodies == body
        dofs = np.flatnonzero(tree.moved_by[body])
        turn, shift = (part[..., dofs].swapaxes(1, 2) for part in (axis, moment))
        push = force[:, own].sum(axis=1)[:, None]
        torque = np.cross(points[:, own], force[:, own]).sum(axis=1)[:, None]
        twist = np.cross(turn, torque) + np.cross(shift, push)
        shove = np.cross(turn, push)
        lever = np.cross(shift, push)
        for centre, along in zip(*(part[:, own].swapaxes(0, 1) for part in (posed.ball_pos, force)),
                                 strict=True):  # fmt: skip
            lever += np.cross(np.cross(turn, centre[:, None]), along[:, None])
        found = turn @ lever.swapaxes(1, 2)
        turned = turn @ twist.swapaxes(1, 2) + shift @ shove.swapaxes(1, 2)
        found -= turned * model.above.T[np.ix_(dofs, dofs)]
        slopes[:, dofs[:, None], dofs] -= found


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
