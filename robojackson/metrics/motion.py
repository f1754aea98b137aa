"""Figures of a motion that need no truth: how smooth it is and how it treats the floor.

Metres and seconds, world frame, z up, floor at z = 0. Definitions as in Shin et al., WHAM (CVPR
2024) and Shen et al., GVHMR (SIGGRAPH Asia 2024) but for what is said below.
"""

import numpy as np
from jaxtyping import Float

from robojackson.motion.smpl import AIR


def acceleration(joints: Float[np.ndarray, "T J 3"], fps: float) -> float:
    """Mean length of the second difference, m/s^2; a still clip has none."""
    return _mean_difference(joints, fps, 2)


def jerk(joints: Float[np.ndarray, "T J 3"], fps: float) -> float:
    """Mean length of the third difference, m/s^3 (WHAM's jitter is a tenth of it)."""
    return _mean_difference(joints, fps, 3)


def foot_slide(feet: Float[np.ndarray, "T K 3"], standing: np.ndarray, fps: float) -> float:
    """Mean horizontal speed of points that stand in two successive frames, m/s; 0 if none do.

    Args:
        feet: Foot points.
        standing: Whether each of them stands, by a truth or by the motion's own contacts.
    """
    held = standing[1:] & standing[:-1]
    if not held.any():
        return 0.0
    speed = np.linalg.norm(np.diff(feet[..., :2], axis=0), axis=-1) * fps
    return float(speed[held].mean())


def floor_penetration(feet: Float[np.ndarray, "T K 3"]) -> float:
    """Greatest depth of a foot point under the floor, metres."""
    return float(max(0.0, -feet[..., 2].min()))


def unsupported(contact: np.ndarray, falling: np.ndarray) -> float:
    """Share of the frames outside free fall in which nothing touches the floor."""
    grounded = ~np.asarray(falling, bool)
    if not grounded.any():
        return 0.0
    return float((np.asarray(contact)[grounded] == AIR).all(1).mean())


def _mean_difference(joints: np.ndarray, fps: float, order: int) -> float:
    if len(joints) <= order:
        return 0.0
    return float(np.linalg.norm(np.diff(joints, order, axis=0), axis=-1).mean() * fps**order)
