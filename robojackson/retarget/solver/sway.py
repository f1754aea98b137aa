"""Sway: move the body over the feet that carry it, step by step.

A single camera sees how far a body leans towards it or away only poorly, and a robot's masses are
not a person's: the zero moment point of a captured motion lies up to tens of centimetres beside the
foot that stands. The least sway that brings it back is a linear-quadratic problem: with s the sway
at the height h of the centre of mass, the zero moment point z becomes z + s - (m h / f) s'', f the
vertical force (Kajita et al., 2003, turned around: Yamane and Nakamura's dynamics filter, 2003).
The keypoints move in proportion to their height, so that standing feet stay. Metres, seconds,
newtons, world frame.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float
from pydantic import Field
from scipy import sparse
from scipy.sparse.linalg import spsolve
from scipy.spatial.transform import Rotation

from robojackson.config import config_dataclass
from robojackson.motion.smpl_sequence import AIR
from robojackson.retarget.feasibility.inverse_dynamics import body_weight, free_space
from robojackson.retarget.solver.balance import support
from robojackson.retarget.solver.clip_problem import Problem
from robojackson.retarget.targets.ground_contact import GRAVITY
from robojackson.retarget.targets.keypoint_targets import Targets
from robojackson.robot.model import Robot
from robojackson.robot.tree_kinematics import centre_of_mass, pose

_LEAST_FORCE = 0.4  # share of the weight: in free fall no point carries
_LEAST_HEIGHT_M = 0.2  # of the centre of mass: a body that lies does not sway
_SAMPLE_S = 0.1  # the distance of the zero moment point is independent after so long


@config_dataclass
class SwayConfig:
    """Settings of the sway.

    Attributes:
        passes: How often the sway is computed, each time from the motion solved again; 0: never.
        spread_m: Standard deviation of the sway at the height of the centre of mass, metres.
        correlation_s: Time in which it changes, seconds.
        point_sd_m: Standard deviation of the zero moment point beside the support, metres.
        margin_m: Distance from the support that costs nothing, metres.
        sole_share: Share of each sole that is taken for its support.
        reach_m: Distance from which a step loses its grip (Cauchy's loss), metres.
        rounds: Times that the nearest points of the support are computed again in a pass.
    """

    passes: int = Field(default=4, ge=0, le=100)
    spread_m: float = Field(default=0.05, ge=1e-3, le=10)
    correlation_s: float = Field(default=0.3, ge=0.01, le=10)
    point_sd_m: float = Field(default=0.04, ge=1e-3, le=10)
    margin_m: float = Field(default=0.02, ge=0, le=10)
    sole_share: float = Field(default=0.8, gt=0, le=1)
    reach_m: float = Field(default=0.15, ge=1e-3, le=10)
    rounds: int = Field(default=8, ge=1, le=100)


class _Pendulum(NamedTuple):
    """A motion as the sway sees it.

    Attributes:
        point: Zero moment point.
        height: Height of the centre of mass.
        force_ratio: Height by vertical force by mass, m h / f, s2.
        soles: Places of the contacts.
        touching: Contacts that carry.
    """

    point: Float[np.ndarray, "S 2"]
    height: Float[np.ndarray, " S"]
    force_ratio: Float[np.ndarray, " S"]
    soles: Float[np.ndarray, "S C 2"]
    touching: Bool[np.ndarray, "S C"]


def swayed(
    problem: Problem, qpos: Float[np.ndarray, "S nq"], config: SwayConfig
) -> tuple[Targets, Float[np.ndarray, "S 2"]]:
    """Return the targets moved by the least sway that brings the zero moment point of a solution
    over its support, and the sway at the height of the centre of mass.

    Args:
        problem: Robot, and the targets of the solution.
        qpos: The solution.
        config: Settings.
    """
    seen, aims = _pendulum(problem, qpos, config), problem.targets
    sway = _least_sway(seen, aims.dt, problem.ring, config)
    keypoints = aims.keypoints_w.copy()
    share = keypoints[..., 2:] / seen.height[:, None, None]
    keypoints[..., :2] += share * sway[:, None]
    return replace(aims, keypoints_w=keypoints), sway


def zero_moment_points(
    robot: Robot,
    qpos: Float[np.ndarray, "S nq"],
    dt: float,
    cycle_offset: Float[np.ndarray, "3"] | None = None,
) -> tuple[Float[np.ndarray, "S 2"], Float[np.ndarray, " S"]]:
    """Return where on the floor one force would carry each step, from inverse dynamics, and the
    vertical force, newtons; at least .4 of the weight, since in free fall no point carries.
    """
    wrench = free_space(robot, qpos, dt, cycle_offset).at(1.0)[:, :6]
    moment = Rotation.from_quat(qpos[:, 3:7], scalar_first=True).apply(wrench[:, 3:])
    vertical = np.maximum(wrench[:, 2], _LEAST_FORCE * body_weight(robot))
    across = qpos[:, 2, None] * wrench[:, :2] + moment[:, [1, 0]] * (1.0, -1.0)
    return qpos[:, :2] - across / vertical[:, None], vertical


def _pendulum(problem: Problem, qpos: Float[np.ndarray, "S nq"], config: SwayConfig) -> _Pendulum:
    robot, aims = problem.robot, problem.targets
    posed = pose(problem.tree, qpos)
    height = np.maximum(centre_of_mass(problem.tree, posed)[:, 2], _LEAST_HEIGHT_M)
    point, vertical = zero_moment_points(robot, qpos, aims.dt, aims.cycle_offset)
    soles = posed.ball_pos[..., :2].copy()
    for body in np.unique(robot.contact_bodies):
        own = robot.contact_bodies == body
        middle = soles[:, own].mean(axis=1, keepdims=True)
        soles[:, own] = middle + config.sole_share * (soles[:, own] - middle)
    return _Pendulum(
        point=point,
        height=height,
        force_ratio=height * (body_weight(robot) / GRAVITY) / vertical,
        soles=soles,
        touching=aims.contact != AIR,
    )


def _least_sway(
    seen: _Pendulum, dt: float, ring: bool, config: SwayConfig
) -> Float[np.ndarray, "S 2"]:
    """Return the minimum of the sway's own cost (of a Gaussian process with a correlation time)
    and of the zero moment point's distance from the support, by reweighted least squares."""
    count, time = len(seen.height), config.correlation_s
    first, second = _difference(count, 1, ring) / dt, _difference(count, 2, ring) / dt**2
    still = sparse.eye_array(count)
    prior = still + time**2 * (first.T @ first) + time**4 / 4.0 * (second.T @ second)
    prior = prior * (dt / time / config.spread_m**2)
    inner = second if ring else sparse.vstack([second[:1], second, second[-1:]])
    move = still - sparse.diags_array(seen.force_ratio) @ inner
    carried = seen.touching.any(axis=1)
    sway = np.zeros((count, 2))
    for _ in range(config.rounds):
        point = seen.point + move @ sway
        away = point - support(point, seen.soles, seen.touching).nearest
        far = np.linalg.norm(away, axis=1)
        beyond = away * np.clip(1.0 - config.margin_m / np.maximum(far, 1e-9), 0.0, None)[:, None]
        weight = carried / (1.0 + (far / config.reach_m) ** 2)
        weight *= dt / _SAMPLE_S / config.point_sd_m**2
        goal = point - beyond - seen.point
        normal = prior + move.T @ sparse.diags_array(weight) @ move
        sway = spsolve(normal.tocsc(), move.T @ (weight[:, None] * goal))
    return np.asarray(sway)


def _difference(count: int, order: int, ring: bool) -> sparse.csr_array:
    """Return the matrix of differences of an order; a ring has one a step."""
    parts = {1: (-1.0, 1.0), 2: (1.0, -2.0, 1.0)}[order]
    if not ring:
        shape = (count - order, count)
        return sparse.diags_array(
            [np.full(count, part) for part in parts], offsets=range(order + 1), shape=shape
        ).tocsr()
    rows = np.arange(count)
    columns = [(rows + shift - order // 2) % count for shift in range(order + 1)]
    values = np.repeat(parts, count)
    return sparse.csr_array(
        (values, (np.tile(rows, order + 1), np.concatenate(columns))), shape=(count, count)
    )
