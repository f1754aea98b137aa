"""Least squares in a box for many small problems at once: a primal-dual interior-point method.

min |A x - b|^2 / 2 + prices x^2 / 2  with  lower <= x <= upper  (Nocedal and Wright, chapter 16.6).
The unknowns are pushes, which are in all rows, and torques, each in one row of its own and taken
out first. All pushes act through a few wrenches, A = feet x spread, so that a step's system is as
small as these (Woodbury's identity). With `relax` the logarithmic barrier stays: mu sum(-log
distance) belongs to the cost.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from jaxtyping import Float, Int

_ITERATIONS = 40
_CENTRING = 0.1
_TO_THE_WALL = 0.98
_ARRIVED = 1e-8  # mean product of a distance to a bound and its multiplier
_STILL = 1e-5  # largest change of an unknown on the relaxed problem
_FAR = 1e9  # a bound that is none


@dataclass(frozen=True)
class Box:
    """Many problems, one a row.

    Attributes:
        feet: What a wrench at each foot adds to each row.
        spread: Wrench of each push.
        stiff: A of the torques, a diagonal under the six rows of the root.
        target: b.
        lower, upper: Bounds of pushes, then torques; infinite where there is none.
        price: Weight of the squares of pushes, then torques.
        relax: Weight of the barrier, mu.
    """

    feet: Float[np.ndarray, "S nv W"]
    spread: Float[np.ndarray, "S W E"]
    stiff: Float[np.ndarray, " J"]
    target: Float[np.ndarray, "S nv"]
    lower: Float[np.ndarray, "S n"]
    upper: Float[np.ndarray, "S n"]
    price: Float[np.ndarray, " n"]
    relax: float = 0.0

    @property
    def edges(self) -> int:
        """Number of pushes."""
        result: int = self.spread.shape[2]
        return result

    def moved(self, pushes: Float[np.ndarray, "S E"]) -> Float[np.ndarray, "S nv"]:
        """Return A times pushes."""
        return _times(self.feet, _times(self.spread, pushes))

    def felt(self, rows: Float[np.ndarray, "S nv"]) -> Float[np.ndarray, "S E"]:
        """Return A transposed times rows."""
        return _times(self.spread.swapaxes(1, 2), _times(self.feet.swapaxes(1, 2), rows))

    @cached_property
    def bounded(self) -> tuple[np.ndarray, np.ndarray]:
        """Where there is a lower bound, and an upper one."""
        return np.isfinite(self.lower), np.isfinite(self.upper)

    @cached_property
    def bounds(self) -> Int[np.ndarray, " S"]:
        """Number of bounds of each row, at least one."""
        below, above = self.bounded
        return np.asarray(np.maximum(below.sum(axis=1) + above.sum(axis=1), 1))

    def at(self, rows: np.ndarray) -> "Box":
        """Return some of the problems."""
        parts = ("feet", "spread", "target", "lower", "upper")
        return replace(self, **{name: getattr(self, name)[rows] for name in parts})


@dataclass(frozen=True)
class Point:
    """Unknowns and the multipliers of their bounds."""

    x: Float[np.ndarray, "S n"]
    low: Float[np.ndarray, "S n"]
    high: Float[np.ndarray, "S n"]

    def above(self, box: Box) -> np.ndarray:
        """Return the distance to the lower bounds."""
        return np.where(box.bounded[0], self.x - box.lower, _FAR)

    def below(self, box: Box) -> np.ndarray:
        """Return the distance to the upper bounds."""
        return np.where(box.bounded[1], box.upper - self.x, _FAR)

    def barrier(self, box: Box) -> Float[np.ndarray, "S n"]:
        """Return the curvature of the bounds' barrier."""
        result: np.ndarray = self.low / self.above(box) + self.high / self.below(box)
        return result


def solve_box(box: Box, start: Point | None = None) -> Point:
    """Return the best unknowns of every row.

    Args:
        start: Those of a problem nearby; only one with a barrier gains by it.
    """
    found = _first(box) if start is None else _begun(box, start)
    x, low, high = found.x, found.low, found.high
    open_rows, part, here = np.arange(len(x)), box, found
    for _ in range(_ITERATIONS):
        walls = here.above(part), here.below(part)
        gaps = _gaps(here, part, walls)
        here, moved = _advanced(here, part, gaps, walls)
        arrived = moved < _STILL if box.relax > 0.0 else gaps < _ARRIVED
        arrived &= gaps < max(_ARRIVED, 1.01 * box.relax)
        if arrived.any():
            done, going = open_rows[arrived], ~arrived
            x[done], low[done], high[done] = here.x[arrived], here.low[arrived], here.high[arrived]
            open_rows, part = open_rows[going], part.at(going)
            here = Point(here.x[going], here.low[going], here.high[going])
        if not len(open_rows):
            break
    x[open_rows], low[open_rows], high[open_rows] = here.x, here.low, here.high
    return Point(x, low, high)


def _first(box: Box) -> Point:
    x = np.zeros(box.lower.shape)
    x[:, : box.edges] = 0.1
    return Point(x, np.isfinite(box.lower) * 1.0, np.isfinite(box.upper) * 1.0)


def _begun(box: Box, start: Point) -> Point:
    """Return a start; rows outside their bounds start from the default."""
    found = _first(box)
    if start.x.shape != found.x.shape:
        return found
    same = ((start.low > 0) == np.isfinite(box.lower)).all(axis=1)
    same &= ((start.high > 0) == np.isfinite(box.upper)).all(axis=1)
    same &= ((start.above(box) > 0) & (start.below(box) > 0)).all(axis=1)
    for mine, given in zip((found.x, found.low, found.high), (start.x, start.low, start.high),
                           strict=True):  # fmt: skip
        mine[same] = given[same]
    return found


def left_over(box: Box, x: Float[np.ndarray, "S n"]) -> Float[np.ndarray, "S nv"]:
    """Return the residual b - A x."""
    left = box.target - box.moved(x[:, : box.edges])
    left[:, 6:] -= box.stiff * x[:, box.edges :]
    return np.asarray(left)


def value(box: Box, point: Point) -> Float[np.ndarray, " S"]:
    """Return the cost, barrier included."""
    squares = np.sum(left_over(box, point.x) ** 2, axis=1) + np.sum(box.price * point.x**2, axis=1)
    walls = np.where(np.isfinite(box.lower), np.log(point.above(box)), 0.0)
    walls += np.where(np.isfinite(box.upper), np.log(point.below(box)), 0.0)
    return np.asarray(squares / 2 - box.relax * walls.sum(axis=1))


_Walls = tuple[np.ndarray, np.ndarray]
"""Distances to the lower and to the upper bounds."""


def _gaps(point: Point, box: Box, walls: _Walls) -> Float[np.ndarray, " S"]:
    """Return the mean complementarity of each row."""
    above, below = walls
    products = above * point.low + below * point.high
    return np.asarray(products.sum(axis=1) / box.bounds)


def _advanced(
    point: Point, box: Box, gaps: np.ndarray, walls: _Walls
) -> tuple[Point, Float[np.ndarray, " S"]]:
    """Return every row after one primal-dual step, and the length of the full step."""
    (above, below), (bounded_low, bounded_high) = walls, box.bounded
    centre = np.maximum(_CENTRING * gaps, box.relax)[:, None]
    push_low = bounded_low * (centre / above)
    push_high = bounded_high * (centre / below)
    pull_low, pull_high = point.low / above, point.high / below
    dx = _newton(box, pull_low + pull_high, push_low - push_high - _gradient(box, point.x))
    d_low = push_low - point.low - pull_low * dx
    d_high = push_high - point.high + pull_high * dx
    share = np.minimum.reduce(
        [_room(above, dx), _room(below, -dx), _room(point.low, d_low), _room(point.high, d_high)]
    )[:, None]
    there = Point(point.x + share * dx, point.low + share * d_low, point.high + share * d_high)
    return there, np.abs(dx).max(axis=1)


def _room(value: np.ndarray, change: np.ndarray) -> np.ndarray:
    """Return the largest share of a change, at most all of it, that keeps every value positive."""
    falling = (change < 0) & (value > 0)
    ratio = np.where(falling, -value / np.where(falling, change, 1.0), np.inf)
    return np.asarray(np.minimum(1.0, _TO_THE_WALL * ratio.min(axis=1)))


def _gradient(box: Box, x: np.ndarray) -> np.ndarray:
    left = left_over(box, x)
    result: np.ndarray = (
        np.concatenate([-box.felt(left), -box.stiff * left[:, 6:]], axis=1) + box.price * x
    )
    return result


def _newton(box: Box, barrier: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Return the torques first, then (Q + G' C G) p = r with Q diagonal and C as small as the
    wrenches."""
    edges, stiff = box.edges, box.stiff
    own = stiff**2 + box.price[edges:] + barrier[:, edges:]
    weight = np.ones(box.target.shape)
    weight[:, 6:] = 1.0 - stiff**2 / own
    shared = np.zeros(box.target.shape)
    shared[:, 6:] = stiff * right[:, edges:] / own
    ease = 1.0 / (box.price[:edges] + barrier[:, :edges])
    turned, unspread = box.feet.swapaxes(1, 2), box.spread.swapaxes(1, 2)
    felt = turned @ (weight[..., None] * box.feet)
    given = (box.spread * ease[:, None]) @ unspread
    reduced = ease * (right[:, :edges] - box.felt(shared))
    unit = np.eye(felt.shape[1])
    wrench = np.linalg.solve(
        unit + felt @ given, _times(felt, _times(box.spread, reduced))[..., None]
    )[..., 0]
    pushes = reduced - ease * _times(unspread, wrench)
    pulled = box.moved(pushes)[:, 6:]
    return np.concatenate([pushes, (right[:, edges:] - stiff * pulled) / own], axis=1)


def _times(matrix: np.ndarray, vector: np.ndarray) -> np.ndarray:
    return np.asarray((matrix @ vector[..., None])[..., 0])
