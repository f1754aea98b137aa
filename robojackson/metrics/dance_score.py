"""The headline score of a dance, which no impostor of `impostors` passes.

Millimetres mean little: on a hip-shake whose joints stray 30 mm from their mean, a robot
that does it half as large is 15 mm wrong, and a good estimate 20 mm. Velocities separate the two.
"""

import numpy as np
from jaxtyping import Float

from robojackson.geometry.rotations import heading
from robojackson.metrics.world_error import align_world

STILL_M = 1e-9
"""A truth whose points move less than this in all is at rest, metres."""


def velocity_score(points: Float[np.ndarray, "T K 3"], truth: Float[np.ndarray, "T K 3"]) -> float:
    """Return 1 - sum |v - v_true|^2 / sum |v_true|^2 over all points and frames, path included.

    The coefficient of determination of the velocities about rest: 1 is the truth, 0 a statue, and
    below it what moves otherwise. Half the amplitude has 0.75; a jump ruins it, because it squares.
    Both in one frame of axes; NaN where the truth is at rest.
    """
    return moving_score(np.diff(points, axis=0), np.diff(truth, axis=0))


def moving_score(velocity: Float[np.ndarray, "T K 3"], true: Float[np.ndarray, "T K 3"]) -> float:
    """Return `velocity_score` of velocities, or of steps, in any unit that both share."""
    power = float(np.sum(true**2))
    if power <= STILL_M**2:
        return float("nan")
    return 1.0 - float(np.sum((velocity - true) ** 2)) / power


def aligned_velocity_score(
    points: Float[np.ndarray, "T K 3"], truth: Float[np.ndarray, "T K 3"]
) -> float:
    """Return `velocity_score` after one rigid motion a clip: for an estimate in a world of its
    own."""
    return velocity_score(align_world(points, truth, scaled=False), truth)


def heading_score(
    points: Float[np.ndarray, "T K 3"],
    root: Float[np.ndarray, "T 4"],
    truth: Float[np.ndarray, "T K 3"],
    true_root: Float[np.ndarray, "T 4"],
) -> float:
    """Return `velocity_score` with each motion seen along its own heading: a slow turn costs
    nothing.

    Args:
        points, truth: World positions, metres; unlike `rollout_score.heading_frame` the path
        counts. root, true_root: Root quaternions wxyz.
    """
    return moving_score(_along(points, root), _along(truth, true_root))


def _along(points: np.ndarray, root: np.ndarray) -> np.ndarray:
    """Return the steps from frame to frame, turned by minus the heading."""
    yaw = heading(root[:-1])
    c, s = np.cos(yaw)[:, None], np.sin(yaw)[:, None]
    x, y, z = np.moveaxis(np.diff(points, axis=0), -1, 0)
    return np.stack([c * x + s * y, -s * x + c * y, z], -1)
