"""Errors of joint positions as the field reports them. Metres, world frame.

`mpjpe_l`: every frame's root position is subtracted, no rotation is removed; `mpjpe_g`: in
the world (PHC, Luo et al., 2023; SONIC, 2025).
"""

import numpy as np
from jaxtyping import Float


def mpjpe(
    points: Float[np.ndarray, "T K 3"],
    target: Float[np.ndarray, "T K 3"],
    root: Float[np.ndarray, "T 3"] | None = None,
    target_root: Float[np.ndarray, "T 3"] | None = None,
) -> float:
    """Return the mean distance of points to their targets, m; relative to the roots where these are
    given."""
    if root is not None and target_root is not None:
        points, target = points - root[:, None], target - target_root[:, None]
    return float(np.linalg.norm(points - target, axis=-1).mean())


def acceleration_ratio(
    points: Float[np.ndarray, "T K 3"], target: Float[np.ndarray, "T K 3"]
) -> float:
    """Return the mean acceleration of points over that of their targets; NaN for fewer than three
    frames or a target that does not accelerate."""
    if len(points) < 3:
        return float("nan")
    own, goal = (np.linalg.norm(np.diff(p, 2, axis=0), axis=-1).mean() for p in (points, target))
    return float(own / goal) if goal > 0 else float("nan")
