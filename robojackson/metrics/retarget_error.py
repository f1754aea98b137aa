"""Figures of a robot motion against its targets; arrays in, floats out.

Metres, radians and seconds in; each name has its unit (mm, deg, cm/s).
"""

import numpy as np
from jaxtyping import Bool, Float

from robojackson.metrics import motion_quality


def keypoint_error_mm(
    actual: Float[np.ndarray, "S K 3"], target: Float[np.ndarray, "S K 3"], weighted: np.ndarray
) -> Float[np.ndarray, "S W"]:
    """Return the distance of each weighted keypoint to its target, millimetres."""
    return np.asarray(1e3 * np.linalg.norm(actual - target, axis=-1)[:, weighted])


def bone_angles_deg(
    actual: Float[np.ndarray, "S K 3"],
    target: Float[np.ndarray, "S K 3"],
    bones: list[tuple[int, int]],
) -> Float[np.ndarray, "S M"]:
    """Return the angle between each bone and its target, degrees."""
    start, end = np.array(bones).T
    a, b = actual[:, end] - actual[:, start], target[:, end] - target[:, start]
    cosine = np.sum(a * b, -1) / (np.linalg.norm(a, axis=-1) * np.linalg.norm(b, axis=-1))
    return np.asarray(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))))


def jerk(points: Float[np.ndarray, "S K 3"], dt: float) -> float:
    """Return the mean length of the third difference, m/s3."""
    return motion_quality.jerk(points, 1.0 / dt)


def hinge_jerk_rms(hinges: Float[np.ndarray, "S J"], dt: float) -> float:
    """Return the root mean square of the hinges' third difference, rad/s3."""
    return float(np.sqrt(np.mean((np.diff(hinges, 3, axis=0) / dt**3) ** 2)))


def limit_excess(
    hinges: Float[np.ndarray, "S J"], lower: np.ndarray, upper: np.ndarray
) -> Float[np.ndarray, "S J"]:
    """Return how far each hinge is outside its limits, radians."""
    result: np.ndarray = np.maximum(np.maximum(lower - hinges, hinges - upper), 0.0)
    return result


def slip_cm_s(
    sole_velocity: Float[np.ndarray, "M C 2"], planted: Bool[np.ndarray, "S C"]
) -> Float[np.ndarray, " P"]:
    """Return the speed of the soles that should stand still, cm/s, over steps planted at both ends.

    Args:
        sole_velocity: Horizontal, from each step to the next, m/s; M is S for a cycle, else S - 1.
        planted: Labels at the steps.
    """
    both = (planted & np.roll(planted, -1, axis=0))[: len(sole_velocity)]
    return np.asarray(100 * np.linalg.norm(sole_velocity, axis=-1)[both])


def unsupported(
    sole_height: Float[np.ndarray, "S C"],
    com_height: Float[np.ndarray, " S"],
    dt: float,
    reach_m: float = 0.01,
    fall: float = 0.4,
    ring: bool = False,
) -> Bool[np.ndarray, " S"]:
    """Return the steps in which no sole is near the floor and yet the body does not fall.

    A levitating motion is detected with any contact labels.

    Args:
        sole_height: Lowest points of the soles over the floor.
        com_height: Centre of mass.
        dt: Seconds a step.
        reach_m: A sole below this can carry, metres.
        fall: Share of gravity from which the body counts as falling.
        ring: Whether the first step follows the last.
    """
    height = np.concatenate([com_height[-2:], com_height, com_height[:2]]) if ring else com_height
    falling = -np.gradient(np.gradient(height, dt), dt) > fall * 9.81
    falling = falling[2:-2] if ring else falling
    return np.asarray((sole_height > reach_m).all(axis=1) & ~falling)
