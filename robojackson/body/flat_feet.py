"""Feet of other skeletons, turned so that a foot that stands flat has a level sole.

How steeply a skeleton draws the line from ankle to toes under a flat foot is its own choice: 24
degrees down in SMPL, level in CMU's files. With the joints taken as they are, SMPL's soles would
point up by the difference, and a foot that stands would touch the floor with its heel alone. The
slope of a flat foot is measured where feet stand still and low. Metres, radians, seconds.
"""

import numpy as np
from jaxtyping import Float

from robojackson.body.feet import REST_SLOPE, lowered
from robojackson.body.forward_kinematics import unit
from robojackson.body.skeleton import keypoint, pair

STILL_MPS = 0.15
LOW_M = 0.05
"""Height of a standing foot's ankle over its lowest place, largest."""
STANDS = np.radians(40.0)
"""Steeper feet stand on their toes or do not stand."""
FLATTEST = 30.0
"""Percentile of the slopes of standing feet that is a flat foot's: heels rise, toes hardly do."""
ENOUGH_S = 0.2
"""Time that feet must stand for a slope to be measured."""
SIDES_APART = np.radians(8.0)
"""Largest difference between a foot's flat slope and that of both feet."""


def with_flat_soles(
    points: Float[np.ndarray, "T 29 3"], fps: float
) -> tuple[Float[np.ndarray, "T 29 3"], Float[np.ndarray, "2"]]:
    """Return keypoints whose balls and toes are turned about the ankles, and the angles.

    Args:
        points: Keypoints, metres; one of the axes is vertical.
        fps: Frames a second.

    Returns:
        The keypoints, and by how much the toes of the left and the right foot are lowered, radians;
        zero where no foot stands long enough, and where they point down far enough.
    """
    slopes, standing = standing_slopes(points, fps, vertical(points))
    if standing.sum() < ENOUGH_S * fps:
        return points, np.zeros(2)
    common = np.percentile(slopes[standing], FLATTEST)
    turned, angles = np.array(points), np.zeros(2)
    joints = zip(pair("knee"), pair("ankle"), pair("foot"), pair("big_toe"), strict=True)
    for side, (knee, ankle, *ends) in enumerate(joints):
        own = slopes[standing[:, side], side]
        flat = np.percentile(own, FLATTEST) if len(own) >= ENOUGH_S * fps else common
        flat = np.clip(flat, common - SIDES_APART, common + SIDES_APART)
        angles[side] = max(REST_SLOPE - flat, 0.0)
        aim = points[:, ends[-1]] - points[:, ankle]
        axis = unit(np.cross(points[:, knee] - points[:, ankle], aim))
        turned[:, ends] = lowered(points, ankle, ends, axis, np.full(len(aim), angles[side]))
    return turned, angles


def vertical(points: Float[np.ndarray, "T 29 3"]) -> Float[np.ndarray, "3"]:
    """Return the axis, with its sign, along which trunks are on average, as a unit vector."""
    trunk = (points[:, keypoint("neck")] - points[:, 0]).mean(0)
    largest = np.argmax(np.abs(trunk))
    return np.asarray(np.eye(3)[largest] * np.sign(trunk[largest]))


def standing_slopes(
    points: Float[np.ndarray, "T 29 3"], fps: float, up: Float[np.ndarray, "3"]
) -> tuple[Float[np.ndarray, "T 2"], np.ndarray]:
    """Return the downward slope from ankle to toe, radians, and whether a foot stands (T, 2)."""
    ankle, toe = points[:, list(pair("ankle"))], points[:, list(pair("big_toe"))]
    aim = toe - ankle
    down = -(aim @ up)
    slope = np.arctan2(down, np.linalg.norm(aim + down[..., None] * up, axis=-1))
    ways = (np.linalg.norm(np.gradient(p, axis=0), axis=-1) * fps for p in (ankle, toe))
    height = ankle @ up
    low = height < np.percentile(height, 2, axis=0) + LOW_M
    standing = low & (np.abs(slope) < STANDS)
    for speed in ways:
        standing &= speed < STILL_MPS
    return slope, standing
