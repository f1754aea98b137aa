"""Solve for the contact pushes and joint torques that produce a motion, and their residual.

For every step: pushes p >= 0 along the edges of the friction pyramids and torques inside their
limits that leave the least of  f - G p - torques,  f being the generalised force of the motion in
free space (root 6, then the hinges). The residual is given in units of a tolerance, so a step is
feasible when its slack is at most 1. Newtons, newton-metres; all steps are solved at once.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float
from pydantic import Field

from robojackson.config import config_dataclass
from robojackson.retarget.feasibility.interior_point import (
    Box,
    Point,
    left_over,
    solve_box,
    value,
)

_PUSH_PRICE = 1e-4  # of pushes that leave the same, the smallest are taken
_TORQUE_PRICE = 1e-4  # ... and those with the smallest torques
_SINGULAR = 1e-13  # share of what the feet can give that keeps its square root real


@config_dataclass
class Tolerance:
    """Residual of a step that still counts as feasible: a tracking robot compensates for it.

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
    """The force that a motion needs and what may supply it, a row a step.

    Attributes:
        force: Generalised force of the motion in free space.
        feet: Generalised force of a unit wrench at each foot, moments first.
        spread: Wrench of one body weight along each pyramid edge.
        usable: Edges of contacts that touch.
        lower, upper: Torque limits of the hinges; infinite where a stop carries.
        scale: Scale of each row of the force: slack a newton or newton-metre.
        ease: Ease of each hinge: one over its torque limit; 0 without a motor.
    """

    force: Float[np.ndarray, "S nv"]
    feet: Float[np.ndarray, "S nv W"]
    spread: Float[np.ndarray, "S W E"]
    usable: Bool[np.ndarray, "S E"]
    lower: Float[np.ndarray, "S J"]
    upper: Float[np.ndarray, "S J"]
    scale: Float[np.ndarray, " nv"]
    ease: Float[np.ndarray, " J"]

    @property
    def columns(self) -> Float[np.ndarray, "S nv E"]:
        """Generalised force of one body weight along each pyramid edge."""
        return np.asarray(self.feet @ self.spread)

    def at(self, rows: np.ndarray) -> "Demand":
        """Return the demand of some of the steps."""
        parts = ("force", "feet", "spread", "usable", "lower", "upper")
        return replace(self, **{name: getattr(self, name)[rows] for name in parts})


@dataclass(frozen=True)
class Supply:
    """The best pushes of every step.

    Attributes:
        pushes: Along the edges, body weights.
        torque: Torque of the hinges, inside limits or not, newton-metres.
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
        point: Where the solver has arrived; the start of a problem nearby.
    """

    pushes: Float[np.ndarray, "S E"]
    value: Float[np.ndarray, " S"]
    slope: Float[np.ndarray, "S nv"]
    point: Point
    _box: Box
    _scale: Float[np.ndarray, " nv"]

    def root(self) -> "Root":
        """Return rows R with R^T R the second derivative."""
        return _root(self._box, self.point, self._scale)


@dataclass(frozen=True)
class Root:
    """Rows R = (1 - U X^T U^T) D with R^T R = D (1 + U U^T)^-1 D (Andrews, 1968).

    Attributes:
        size: D, of each row.
        wrench: U, what the feet can give beside the tolerances.
        mix: X = L^-T (1 + L)^-1 with L L^T = 1 + U^T U.
    """

    size: Float[np.ndarray, "S nv"]
    wrench: Float[np.ndarray, "S nv W"]
    mix: Float[np.ndarray, "S W W"]

    def at(self, rows: slice) -> "Root":
        """Return those of some of the steps."""
        return Root(self.size[rows], self.wrench[rows], self.mix[rows])

    def __matmul__(self, matrix: Float[np.ndarray, "S nv M"]) -> Float[np.ndarray, "S nv M"]:
        """Return R times a matrix a step."""
        out = self.size[..., None] * matrix
        out -= (self.wrench @ self.mix.swapaxes(1, 2)) @ (self.wrench.swapaxes(1, 2) @ out)
        return np.asarray(out)


def supply(demand: Demand) -> Supply:
    """Return the pushes that leave the smallest residual."""
    point = solve_box(_box(demand, 0.0))
    pushes = point.x[:, : demand.usable.shape[1]] * demand.usable
    given = (demand.feet @ (demand.spread @ pushes[..., None]))[..., 0]
    left = demand.force - given
    torque = left[:, 6:].copy()
    left[:, 6:] -= np.clip(torque, demand.lower, demand.upper)
    return Supply(pushes, torque, left * demand.scale)


def relaxed(demand: Demand, barrier: float, start: Point | None = None) -> Relaxed:
    """Return the same, smooth: the second derivative grows near every limit.

    V(f) = min_x |S f - A x|^2 / 2 + ...: V' = S left, V'' = S (1 + A Q^-1 A^T)^-1 S with Q the
    curvature of prices and barrier.

    Args:
        start: Solution of a nearby problem.
    """
    box = _box(demand, barrier)
    point = solve_box(box, start)
    left = left_over(box, point.x)
    pushes = point.x[:, : box.edges] * demand.usable
    return Relaxed(pushes, value(box, point), left * demand.scale, point, box, demand.scale)


def _root(box: Box, point: Point, scale: Float[np.ndarray, " nv"]) -> Root:
    ease = 1.0 / (box.price + point.barrier(box))
    own = np.ones(box.target.shape)
    own[:, 6:] += box.stiff**2 * ease[:, box.edges :]
    given = (box.spread * ease[:, None, : box.edges]) @ box.spread.swapaxes(1, 2)
    unit = np.eye(given.shape[1])
    floor = _SINGULAR * np.trace(given, axis1=1, axis2=2)[:, None, None] + _SINGULAR
    wrench = (box.feet / np.sqrt(own)[..., None]) @ np.linalg.cholesky(given + floor * unit)
    factor = np.linalg.cholesky(unit + wrench.swapaxes(1, 2) @ wrench)
    mix = np.linalg.inv((unit + factor) @ factor.swapaxes(1, 2))
    return Root(scale / np.sqrt(own), wrench, mix)


def _box(demand: Demand, relax: float) -> Box:
    """Return the problem in tolerances; torques as shares of their limits."""
    steps, count = demand.usable.shape
    edges = np.zeros((steps, count))
    unit = np.where(demand.ease > 0, demand.ease, 1.0)
    prices = [np.full(count, _PUSH_PRICE), np.full(len(unit), _TORQUE_PRICE)]
    return Box(
        feet=demand.feet * demand.scale[:, None],
        spread=demand.spread * demand.usable[:, None],
        stiff=demand.scale[6:] / unit,
        target=demand.force * demand.scale,
        lower=np.concatenate([edges, demand.lower * unit], axis=1),
        upper=np.concatenate([edges + np.inf, demand.upper * unit], axis=1),
        price=np.concatenate(prices),
        relax=relax,
    )
