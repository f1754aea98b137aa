"""Parts of a motion by which it is decided whether a robot can do it: clip, ways and stands."""

import numpy as np
from jaxtyping import Bool

from robojackson.retarget.targets.keypoint_targets import Targets

STILL_M = 1e-6
"""Targets that move less a step are a stand's."""
SHORTEST_S = 0.2
"""A stand that is shorter is the beginning or the end of a way."""


def moving(aims: Targets) -> Bool[np.ndarray, " S"]:
    """Return the steps after which the targets move."""
    points = aims.keypoints_w
    result: np.ndarray = np.abs(np.diff(points, axis=0, append=points[-1:])).max((1, 2)) > STILL_M
    return result


def parts_of(aims: Targets, danced: Bool[np.ndarray, " S"]) -> tuple[Bool[np.ndarray, " S"], ...]:
    """Return the steps of the clip, of the ways into and out of it, and of the stands; those that
    a motion has.

    Args:
        aims: The targets.
        danced: The steps of the clip.
    """
    moves = moving(aims)
    if (~moves & ~danced).sum() * aims.dt < SHORTEST_S:
        moves = np.ones_like(moves)
    parts = (danced, moves & ~danced, ~moves & ~danced)
    return tuple(part for part in parts if part.any())
