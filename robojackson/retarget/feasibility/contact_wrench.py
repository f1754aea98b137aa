"""Which contact pushes and joint torques together produce a motion, and what they leave over.

For every step: pushes p >= 0 along the edges of the friction pyramids and torques inside their
limits that leave the least of  f - G p - torques,  f being the generalised force of the motion in
free space (root 6, then the hinges). What is left is told in units of a tolerance, so a step is
feasible when its slack is at most 1. Newtons, newton-metres; all steps are solved at once.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from pydantic import Field

from robojackson.config import config_dataclass
from robojackson.retarget.feasibility.interior_point import Box, left_over, solve_box, value

_PUSH_PRICE = 1e-4  # of pushes that leave the same, the smallest are taken
_TORQUE_PRICE = 1e-4  # ... and those with the smallest torques


@config_dataclass
class Tolerance:
    """What may be left over in a step that counts as feasible: a tracking robot makes up for it.

    Attributes:
        force_bw: Force on the root, body weights.
        lever_m: Moment on the root, as the lever of one body weight, metres.
        torque: Torque beyond a limit, share of the limit.
    """

    force_bw: float = Field(default=0.1, gt=0)
    lever_m: float = Field(default=0.03, gt=0)
    torque: float = Field(default=0.05, gt=0)


@dataclass(frozen=True)
class Demand:
    """What a motion asks for and what may give it, a row a step.

    Attributes:
        force: Generalised force of the motion in free space.
        columns: Generalised force of one body weight along each pyramid edge.
        usable: Edges of contacts that touch.
        lower, upper: Torque limits of the hinges; infinite where a stop carries.
        scale: Of each row of the force: slack a newton or newton-metre.
        ease: Of each hinge: one over its torque limit; 0 without a motor.
    """

    force: Float[np.ndarray, "S nv"]
    columns: Float[np.ndarray, "S nv E"]
    usable: Bool[np.ndarray, "S E"]
    lower: Float[np.ndarray, "S J"]
    upper: Float[np.ndarray, "S J"]
    scale: Float[np.ndarray, " nv"]
    ease: Float[np.ndarray, " J"]


@dataclass(frozen=True)
class Supply:
    """The best pushes of every step.

    Attributes:
        pushes: Along the edges, body weights.
        torque: Of the hinges, inside limits or not, newton-metres.
        left: What is left over of each row, in tolerances; zero on a hinge inside its limits.
        slack: Its norm; feasible up to 1.
    """

    pushes: Float[np.ndarray, "S E"]
    torque: Float[np.ndarray, "S J"]
    left: Float[np.ndarray, "S nv"]

    @property
    def slack(self) -> Float[np.ndarray, " S"]:
        """Norm of what is left over."""
        return np.asarray(np.linalg.norm(self.left, axis=1))


@dataclass(frozen=True)
class Relaxed:
    """The least that is left over, made smooth in the force: a barrier keeps off every limit.

    Attributes:
        pushes: Along the edges, body weights.
        value: Half the square of what is left over, and the barrier.
        slope: Derivative of the value in the force.
        root: Rows R with R^T R the second derivative, and
        residual: r with R^T r the slope.
    """

    pushes: Float[np.ndarray, "S E"]
    value: Float[np.ndarray, " S"]
    slope: Float[np.ndarray, "S nv"]
    root: Float[np.ndarray, "S nv nv"]
    residual: Float[np.ndarray, "S nv"]


def supply(demand: Demand) -> Supply:
    """The pushes that leave the least."""
    point = solve_box(_box(demand, 0.0))
    pushes = point.x[:, : demand.columns.shape[2]] * demand.usable
    left = demand.force - (demand.columns @ pushes[..., None])[..., 0]
    torque = left[:, 6:].copy()
    left[:, 6:] -= np.clip(torque, demand.lower, demand.upper)
    return Supply(pushes, torque, left * demand.scale)


def relaxed(demand: Demand, barrier: float) -> Relaxed:
    """The same, smooth: the second derivative tells how near all limits are.

    V(f) = min_x |S f - A x|^2 / 2 + ...: V' = S left, V'' = S (1 + A Q^-1 A^T)^-1 S with Q the
    curvature of prices and barrier.
    """
    box = _box(demand, barrier)
    point = solve_box(box)
    left = left_over(box, point.x)
    ease = 1.0 / (box.price + point.barrier(box))
    inner = (box.columns * ease[:, None, : box.edges]) @ box.columns.swapaxes(1, 2)
    rows, hinges = np.arange(inner.shape[1]), np.arange(6, inner.shape[1])
    inner[:, hinges, hinges] += box.stiff**2 * ease[:, box.edges :]
    inner[:, rows, rows] += 1.0
    factor = np.linalg.cholesky(inner)
    root = np.linalg.solve(factor, np.broadcast_to(np.diag(demand.scale), factor.shape))
    residual = (factor.swapaxes(1, 2) @ left[..., None])[..., 0]
    pushes = point.x[:, : box.edges] * demand.usable
    return Relaxed(pushes, value(box, point), left * demand.scale, root, residual)


def _box(demand: Demand, relax: float) -> Box:
    """The problem in tolerances; torques as shares of their limits."""
    steps, count = demand.usable.shape
    edges = np.zeros((steps, count))
    unit = np.where(demand.ease > 0, demand.ease, 1.0)
    prices = [np.full(count, _PUSH_PRICE), np.full(len(unit), _TORQUE_PRICE)]
    return Box(
        columns=demand.columns * demand.usable[:, None] * demand.scale[:, None],
        stiff=demand.scale[6:] / unit,
        target=demand.force * demand.scale,
        lower=np.concatenate([edges, demand.lower * unit], axis=1),
        upper=np.concatenate([edges + np.inf, demand.upper * unit], axis=1),
        price=np.concatenate(prices),
        relax=relax,
    )
