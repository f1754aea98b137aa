"""Up and the focal length from straight edges of the scene.

Rooms have vertical edges, and horizontal ones in two directions that are square to each other;
their images meet in three vanishing points (Manhattan world: Coughlan and Yuille, ICCV 1999).
Directions of up near that of the body, headings of the horizontal edges and focal lengths are tried
on grids: each edge follows one of the three directions, with a small error of its angle, or none of
them. Edges share their causes (both sides of a beam), so that their likelihood is tempered. The
stated spread contains other directions that explain the edges as well. Camera frame as in
`landmarks.pinhole_camera`; radians, lengths in image diagonals.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from robojackson.body.forward_kinematics import unit
from robojackson.mocap.landmarks.pinhole_camera import FOCAL_PER_DIAGONAL

FEWEST, MOST, FIRST, SECTORS = 3, 120, 60, 12
"""Edges that are needed, that are used, and that are used for the coarse grid: the longest ones of
each sector of directions in turn, since one family of edges alone shows nothing."""
LONGEST, WEIGHT = 0.15, 30.0
"""Length beyond which an edge counts no more, diagonals; weight for each diagonal of length."""
OUTLIERS, TEMPER = 0.4, 0.2
"""Share of edges that follow no direction; exponent of the likelihood."""
FOCALS = np.exp(np.linspace(np.log(0.5), np.log(1.75), 9))
NEAR_FOCALS = np.exp(np.linspace(-0.16, 0.16, 9))
"""Focal lengths of the coarse grid, diagonals, and their factors in the fine grid."""
FOCAL_SD, UP_SD = 0.3, np.radians(10.0)
"""Spreads of the prior: of the logarithm of the focal length, and of the body's up."""
REACH, STEP, SIGMA = np.radians([36.0, 3.0, 2.0])
NEAR_REACH, NEAR_STEP, NEAR_SIGMA = np.radians([3.0, 0.75, 1.0])
"""Radius and step of the grids of up; standard deviation of an edge's angle there."""
HEADINGS = np.radians(np.arange(0.0, 90.0, 4.0))
NEAR_HEADINGS = np.radians(np.arange(-4.0, 4.1, 1.0))
LEAST_SD = np.radians(0.8)


@dataclass(frozen=True)
class SceneEvidence:
    """What the edges show.

    Attributes:
        up: Unit vector against gravity, camera axes.
        sd: Standard deviation of its error, radians.
        focal_px: Focal length, pixels.
        focal_sd: Standard deviation of its logarithm.
    """

    up: Float[np.ndarray, "3"]
    sd: float
    focal_px: float
    focal_sd: float


def scene_evidence(
    edges: Float[np.ndarray, "N 4"], width: int, height: int, body_up: Float[np.ndarray, "3"]
) -> SceneEvidence | None:
    """Return up and the focal length; None with fewer than three edges.

    Args:
        edges: Ends (x0, y0, x1, y1) of straight edges, pixels.
        width, height: Size of the picture, pixels.
        body_up: Direction near which up is sought, camera axes.
    """
    diagonal = float(np.hypot(width, height))
    edges = edges[(edges[:, :2] != edges[:, 2:]).any(1)]
    if len(edges) < FEWEST:
        return None
    scene, body_up = _Edges.of(edges, width, height), unit(body_up)
    few = scene.first(FIRST)
    wide = _around(body_up, REACH, STEP)
    coarse = np.empty((len(FOCALS), len(wide)))
    headings = np.empty_like(coarse)
    for number, focal in enumerate(FOCALS):
        fit, headings[number] = few.fit(wide, HEADINGS, focal, SIGMA)
        coarse[number] = TEMPER * fit + _prior(wide, body_up, focal)
    row, column = np.unravel_index(coarse.argmax(), coarse.shape)
    near, focals = _around(wide[column], NEAR_REACH, NEAR_STEP), FOCALS[row] * NEAR_FOCALS
    fine = np.empty((len(focals), len(near)))
    for number, focal in enumerate(focals):
        fit, _ = scene.fit(near, headings[row, column] + NEAR_HEADINGS, focal, NEAR_SIGMA)
        fine[number] = TEMPER * fit + _prior(near, body_up, focal)
    share, far = _shares(fine), _shares(coarse)
    up = unit(share.sum(0) @ near)
    spread = [_variance(far, wide, up), _variance(share, near, up)]
    log_focal = share.sum(1) @ np.log(focals)
    focal_spread = [
        odds.sum(1) @ (np.log(tried) - log_focal) ** 2
        for odds, tried in ((far, FOCALS), (share, focals))
    ]
    return SceneEvidence(
        up=up,
        sd=float(np.sqrt(max(spread) + LEAST_SD**2)),
        focal_px=float(np.exp(log_focal)) * diagonal,
        focal_sd=float(np.sqrt(max(focal_spread))),
    )


@dataclass(frozen=True)
class _Edges:
    """Directions, middles (from the image's middle) and weights of edges, those of each sector in
    turn, longest first."""

    line: Float[np.ndarray, "N 2"]
    middle: Float[np.ndarray, "N 2"]
    weight: Float[np.ndarray, " N"]

    @classmethod
    def of(cls, edges: Float[np.ndarray, "N 4"], width: int, height: int) -> "_Edges":
        diagonal = np.hypot(width, height)
        ends = (edges.reshape(-1, 2, 2) - [width / 2.0, height / 2.0]) / diagonal
        along = ends[:, 1] - ends[:, 0]
        length = np.linalg.norm(along, axis=1)
        sector = np.arctan2(along[:, 1], along[:, 0]) % np.pi // (np.pi / SECTORS)
        rank = np.zeros(len(length))
        for one in np.unique(sector):
            (members,) = np.nonzero(sector == one)
            rank[members[np.argsort(-length[members])]] = np.arange(len(members))
        rows = np.lexsort((-length, rank))[:MOST]
        weight = WEIGHT * np.minimum(length[rows], LONGEST)
        return cls(along[rows] / length[rows, None], ends[rows].mean(1), weight)

    def first(self, count: int) -> "_Edges":
        """Return the first edges, with the weight of all."""
        weight = self.weight[:count] * self.weight.sum() / self.weight[:count].sum()
        return _Edges(self.line[:count], self.middle[:count], weight)

    def fit(
        self,
        ups: Float[np.ndarray, "U 3"],
        headings: Float[np.ndarray, " H"],
        focal: float,
        sigma: float,
    ) -> tuple[Float[np.ndarray, " U"], Float[np.ndarray, " U"]]:
        """Return the logarithm of the likelihood of each up over that of edges at random, at the
        best heading, and that heading."""
        right, ahead = _horizontal(ups)
        vertical = self._follows(ups, focal, sigma)
        best, found = np.full(len(ups), -np.inf), np.zeros(len(ups))
        for heading in headings:
            cos, sin = np.cos(heading), np.sin(heading)
            along = vertical + self._follows(cos * right + sin * ahead, focal, sigma)
            along += self._follows(cos * ahead - sin * right, focal, sigma)
            value = self.weight @ np.log(OUTLIERS + (1.0 - OUTLIERS) / 3.0 * along)
            better = value > best
            best, found = np.where(better, value, best), np.where(better, heading, found)
        return best, found

    def _follows(
        self, directions: Float[np.ndarray, "U 3"], focal: float, sigma: float
    ) -> Float[np.ndarray, "N U"]:
        """Return how likely each edge is along each direction, over an edge at random."""
        middle = self.middle / focal
        x = directions[:, 0] - np.outer(middle[:, 0], directions[:, 2])
        y = directions[:, 1] - np.outer(middle[:, 1], directions[:, 2])
        across = (self.line[:, :1] * y - self.line[:, 1:] * x) ** 2
        sine = across / np.maximum(x**2 + y**2, 1e-12)
        peak = np.sqrt(np.pi / 2.0) / sigma
        result: np.ndarray = peak * np.exp(-0.5 * sine / sigma**2)
        return result


def _horizontal(
    ups: Float[np.ndarray, "U 3"],
) -> tuple[Float[np.ndarray, "U 3"], Float[np.ndarray, "U 3"]]:
    """Return two directions that are square to each up and to each other."""
    right = np.cross(ups, [0.0, 0.0, 1.0])
    length = np.linalg.norm(right, axis=1, keepdims=True)
    right = np.where(length > 1e-3, right / np.maximum(length, 1e-3), [1.0, 0.0, 0.0])
    return right, np.cross(ups, right)


def _around(centre: Float[np.ndarray, "3"], reach: float, step: float) -> Float[np.ndarray, "U 3"]:
    """Return unit vectors on a square grid within an angle around one."""
    right, ahead = (found[0] for found in _horizontal(centre[None]))
    steps = step * np.arange(-round(reach / step), round(reach / step) + 1)
    x, y = (grid.ravel() for grid in np.meshgrid(steps, steps))
    angle = np.hypot(x, y)
    x, y, angle = (values[angle <= reach + 1e-9] for values in (x, y, angle))
    scale = np.sinc(angle / np.pi)[:, None]
    side = x[:, None] * right + y[:, None] * ahead
    return np.asarray(np.cos(angle)[:, None] * centre + scale * side)


def _prior(
    ups: Float[np.ndarray, "U 3"], body_up: Float[np.ndarray, "3"], focal: float
) -> Float[np.ndarray, " U"]:
    angle = np.arccos(np.clip(ups @ body_up, -1.0, 1.0)) / UP_SD
    odd = np.log(focal / FOCAL_PER_DIAGONAL) / FOCAL_SD
    return np.asarray(-0.5 * (angle**2 + odd**2))


def _shares(score: Float[np.ndarray, "F U"]) -> Float[np.ndarray, "F U"]:
    share = np.exp(score - score.max())
    return np.asarray(share / share.sum())


def _variance(
    share: Float[np.ndarray, "F U"], ups: Float[np.ndarray, "U 3"], up: Float[np.ndarray, "3"]
) -> float:
    return float(share.sum(0) @ np.arccos(np.clip(ups @ up, -1.0, 1.0)) ** 2)
