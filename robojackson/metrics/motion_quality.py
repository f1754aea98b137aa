"""Smoothness of a motion and its contact with the floor, alone and beside a truth.

Metres and seconds, world frame, z up, floor at z = 0. Definitions as in Shin et al., WHAM (CVPR
2024) and Shen et al., GVHMR (SIGGRAPH Asia 2024) except as noted below. None of them is a
headline: a frozen pose is smooth, does not slide and stands well (`docs/metrics.md`).
"""

import numpy as np
from jaxtyping import Float

from robojackson.motion.smpl_sequence import AIR


def acceleration(joints: Float[np.ndarray, "T J 3"], fps: float) -> float:
    """Return the mean length of the second difference, m/s^2; a still clip has none."""
    return _mean_difference(joints, fps, 2)


def jerk(joints: Float[np.ndarray, "T J 3"], fps: float) -> float:
    """Return the mean length of the third difference, m/s^3 (WHAM's jitter is a tenth of it)."""
    return _mean_difference(joints, fps, 3)


def jitter(joints: Float[np.ndarray, "T J 3"], fps: float) -> float:
    """Return WHAM's and GVHMR's jitter, 10 m/s^3: a tenth of the jerk."""
    return jerk(joints, fps) / 10.0


def acceleration_error(
    joints: Float[np.ndarray, "T J 3"], truth: Float[np.ndarray, "T J 3"], fps: float
) -> float:
    """Return the mean error of the second difference, m/s^2 (Accel of Kanazawa et al., HMMR, CVPR
    2019).

    No headline: a frozen pose has the truth's own acceleration as its error, a jittery estimate
    of the right motion more.
    """
    return _mean_difference(joints - truth, fps, 2)


def foot_slide_mm(
    feet: Float[np.ndarray, "T K 3"], truth: Float[np.ndarray, "T K 3"], still_m: float = 0.01
) -> float:
    """Return WHAM's foot sliding: mean step of foot points whose true step is below 1 cm, mm a
    frame.

    Args:
        feet, truth: Foot points, one frame of axes.
        still_m: A true step from which the foot does not stand, metres a frame.
    """
    steps, true = (np.linalg.norm(np.diff(x, axis=0), axis=-1) for x in (feet, truth))
    stands = true < still_m
    return float(1e3 * steps[stands].mean()) if stands.any() else 0.0


def contact_f1(found: np.ndarray, true: np.ndarray) -> float:
    """Return the harmonic mean of precision and recall (van Rijsbergen 1979) of contact flags of
    any shape.

    1 where there is nothing to find and nothing is found.
    """
    found, true = np.asarray(found, bool), np.asarray(true, bool)
    total = int(found.sum()) + int(true.sum())
    return 2.0 * float((found & true).sum()) / total if total else 1.0


def foot_slide(feet: Float[np.ndarray, "T K 3"], standing: np.ndarray, fps: float) -> float:
    """Return the mean horizontal speed of points that stand in two successive frames, m/s; 0 if
    none do.

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
    """Return the greatest depth of a foot point under the floor, metres."""
    return float(max(0.0, -feet[..., 2].min()))


def unsupported(contact: np.ndarray, falling: np.ndarray) -> float:
    """Return the share of the frames outside free fall in which nothing touches the floor."""
    grounded = ~np.asarray(falling, bool)
    if not grounded.any():
        return 0.0
    return float((np.asarray(contact)[grounded] == AIR).all(1).mean())


def _mean_difference(joints: np.ndarray, fps: float, order: int) -> float:
    if len(joints) <= order:
        return 0.0
    return float(np.linalg.norm(np.diff(joints, order, axis=0), axis=-1).mean() * fps**order)
