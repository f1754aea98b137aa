"""Terms of the feet and of touching: floor, slip, balance and collisions.

Each adds squared residuals to the normal equations of a clip. Metres, radians, seconds.
"""

from collections.abc import Callable
from functools import cache

import numpy as np
from jaxtyping import Bool, Float
from scipy.ndimage import distance_transform_edt

from robojackson.motion.smpl_sequence import AIR, PLANTED
from robojackson.retarget.solver.balance import support
from robojackson.retarget.solver.block_banded import Normal
from robojackson.retarget.solver.clip_problem import Problem
from robojackson.retarget.solver.collision import Touches
from robojackson.retarget.targets.ground_contact import GRAVITY
from robojackson.robot.tree_kinematics import (
    Posed,
    centre_of_mass,
    com_jacobian,
    point_jacobian,
    sole_velocities,
)

_SETTLING_S = 0.15  # seconds


def add_contacts(problem: Problem, posed: Posed, out: Normal) -> None:
    """Add contact height, floor under feet in the air, and no slip of planted soles."""
    robot, weights, contact = problem.robot, problem.weights, problem.targets.contact
    ground = posed.ball_pos.copy()
    ground[..., 2] -= robot.contact_radii

    @cache
    def jacobian() -> Float[np.ndarray, "N C 3 nv"]:
        return point_jacobian(problem.tree, posed, ground, robot.contact_bodies)

    height = ground[..., 2]
    touching = contact != AIR
    inside = ~touching & (height < weights.clearance)
    sunk = touching & (height < 0)
    factor = np.where(touching, weights.height, np.where(inside, weights.penetration, 0.0))
    factor = np.sqrt(np.where(sunk, np.maximum(weights.height, weights.penetration), factor))
    depth = np.where(inside, height - weights.clearance, height)
    out.add_rows(factor * depth, lambda: factor[..., None] * jacobian()[:, :, 2])
    _no_slip(problem, posed, lambda: jacobian()[:, :, :2], out)


def _no_slip(
    problem: Problem,
    posed: Posed,
    jacobian: Callable[[], Float[np.ndarray, "N C 2 nv"]],
    out: Normal,
) -> None:
    """Add the no-slip term: motion of a planted ball's centre beyond its rolling costs.

    The derivative of the slip is the Jacobian of the ground point, at each of the two steps its
    own.
    """
    planted, dt = problem.targets.contact == PLANTED, problem.targets.dt
    both = planted & np.roll(planted, -1, axis=0)
    count = len(planted) if problem.ring else len(planted) - 1
    now = np.flatnonzero(both[:count].any(axis=1))
    if not len(now):
        return
    following = (now + 1) % len(planted)
    factor = np.sqrt(problem.weights.slip) * both[now]
    speed = sole_velocities(problem.robot, posed, dt, problem.targets.cycle_offset)[now]
    residual = factor[..., None] * speed

    def rows() -> tuple[Float[np.ndarray, "M R nv"], ...]:
        each = jacobian()
        before = factor[..., None, None] * each[now] / -dt
        after = factor[..., None, None] * each[following] / dt
        flat = (len(now), -1, each.shape[-1])
        return before.reshape(flat), after.reshape(flat)

    out.add_chained(residual.reshape(len(now), -1), rows, now)


def add_collisions(problem: Problem, posed: Posed, touches: Touches, out: Normal) -> None:
    """Add the penetration hinge of self contacts and of the floor under all bodies but the feet."""
    feet = np.isin(touches.bodies, problem.robot.foot_bodies).any(axis=1)
    keep = (touches.distance < problem.weights.clearance) & ~(touches.floor & feet)
    if not keep.any():
        return
    frame, bodies, floor = touches.frame[keep], touches.bodies[keep], touches.floor[keep]
    weights = problem.weights
    factor = np.sqrt(np.where(floor, weights.penetration, weights.self_penetration))
    residual = factor * (touches.distance[keep] - weights.clearance)
    out.cost += 0.5 * float(np.sum(residual**2))

    def add() -> None:
        points = np.repeat(touches.position[keep][:, None], 2, axis=1)
        jacobian = point_jacobian(problem.tree, posed[frame], points, bodies)
        apart = jacobian[:, 1] - jacobian[:, 0]
        rows = factor[:, None] * np.einsum("mi,mij->mj", touches.normal[keep], apart)
        np.add.at(out.gradient, frame, rows * residual[:, None])
        np.add.at(out.blocks[0], frame, rows[:, :, None] * rows[:, None, :])

    out.later(add)


def add_balance(problem: Problem, posed: Posed, out: Normal) -> None:
    """Add the balance term: the zero moment point stays in the hull of the soles in contact.

    zmp = c - h/g c'' (linear inverted pendulum); residual = zmp - nearest point of the support.
    A ball foot cannot take a moment: on one foot the support is a point, on two a segment. While
    the weight goes from foot to foot the support jumps, and the term fades out and in again.
    """
    robot, dt = problem.robot, problem.targets.dt
    inner, before, after = _neighbours(len(posed.axis), problem.ring)
    com = centre_of_mass(problem.tree, posed)
    pull = com[:, 2:].mean() / GRAVITY / dt**2
    flat = com[:, :2]
    ahead, behind = flat[after].copy(), flat[before].copy()
    if problem.targets.cycle_offset is not None:
        ahead[-1] += problem.targets.cycle_offset[:2]
        behind[0] -= problem.targets.cycle_offset[:2]
    zmp = flat[inner] - pull * (ahead - 2 * flat[inner] + behind)
    feet = posed.ball_pos
    touching = problem.targets.contact != AIR
    found = support(zmp, feet[inner, :, :2], touching[inner])
    share, away = found.weights, zmp - found.nearest
    settled = _settled(touching, dt, problem.ring)[inner]
    weight = _robust_weight(problem, away, settled, out) * (away != 0).any(axis=1)

    def rows() -> tuple[Float[np.ndarray, "M 2 nv"], ...]:
        com_rows = com_jacobian(problem.tree, posed)[:, :2]
        feet_rows = point_jacobian(problem.tree, posed, feet, robot.contact_bodies)[inner, :, :2]
        here = (1 + 2 * pull) * com_rows[inner] - np.einsum("nc,ncij->nij", share, feet_rows)
        scale = weight[:, None, None]
        return -pull * scale * com_rows[before], scale * here, -pull * scale * com_rows[after]

    out.add_chained(weight[:, None] * away, rows, before)


def _settled(touching: Bool[np.ndarray, "N C"], dt: float, ring: bool) -> Float[np.ndarray, " N"]:
    """Return 0 where nothing touches or the contacts change, 1 from some time before and after."""
    changes = (touching != np.roll(touching, 1, axis=0)).any(axis=1)
    changes[0] &= ring
    still = ~(changes | np.roll(changes, -1))
    joined = np.tile(still, 3) if ring else still
    steps = distance_transform_edt(joined) if not joined.all() else np.full(len(joined), np.inf)
    steps = steps[len(still) : 2 * len(still)] if ring else steps
    return np.asarray(np.clip(steps * dt / _SETTLING_S, 0, 1) ** 2 * touching.any(axis=1))


def _robust_weight(
    problem: Problem, away: Float[np.ndarray, "N 2"], carried: np.ndarray, out: Normal
) -> Float[np.ndarray, " N"]:
    """Return the square roots of Cauchy weights; corrects the cost from the squares to Cauchy's
    loss.

    A wrong contact label puts the support where no body could stand: it must not bend the motion.
    """
    reach = problem.weights.balance_reach
    share = np.sum(away**2, axis=1) / reach**2
    weight = problem.weights.balance * carried / (1.0 + share)
    loss = problem.weights.balance * carried * np.log1p(share) * reach**2
    out.cost += 0.5 * float(np.sum(loss - weight * share * reach**2))
    result: np.ndarray = np.sqrt(weight)
    return result


def _neighbours(frames: int, ring: bool) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return frames with two neighbours, the ones before and the ones after."""
    inner = np.arange(frames) if ring else np.arange(1, frames - 1)
    return inner, (inner - 1) % frames, (inner + 1) % frames
