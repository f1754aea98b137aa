"""Nearness of two human motions: the share of one that the other contains, mirrored or not.

A window of a motion is one second of SMPL joints at 10 Hz, relative to the pelvis and turned by the
heading of its first frame. Its distance to another is the mean distance of the joints, metres.
"""

import numpy as np
from jaxtyping import Float

from robojackson.motion.smpl_sequence import SmplSequence

RATE_HZ = 10.0
WINDOW = 10
"""Frames of a window at that rate."""
LEFT_HIP, RIGHT_HIP = 1, 2
MIRROR = (0, 2, 1, 3, 5, 4, 6, 8, 7, 9, 11, 10, 12, 14, 13, 15, 17, 16, 19, 18, 21, 20, 23, 22)
"""The SMPL joint that stands in each joint's place in a mirrored body."""
NEAR_M = 0.08
"""Windows nearer than this are the same movement."""


def windows(sequence: SmplSequence, mirrored: bool = False) -> Float[np.ndarray, "W F 24 3"]:
    """Return all windows of a motion; none where it is shorter than a second."""
    joints = np.asarray(sequence.joints, float)
    if mirrored:
        joints = joints[:, MIRROR] * [1.0, -1.0, 1.0]
    stride = max(1, round(sequence.fps / RATE_HZ))
    sampled = joints[::stride]
    count = max(0, len(sampled) - WINDOW + 1)
    found = [_turned(sampled[first : first + WINDOW]) for first in range(count)]
    return np.array(found).reshape(count, WINDOW, 24, 3)


def contained_share(
    motion: Float[np.ndarray, "W F 24 3"], pool: Float[np.ndarray, "V F 24 3"]
) -> float:
    """Return the share of a motion's windows to which some window of the pool is near."""
    if not len(motion) or not len(pool):
        return 0.0
    return float(np.mean([distances(window, pool).min() < NEAR_M for window in motion]))


def distances(
    window: Float[np.ndarray, "F 24 3"], pool: Float[np.ndarray, "V F 24 3"]
) -> Float[np.ndarray, " V"]:
    """Return the distance of a window to each of the pool, metres."""
    result: np.ndarray = np.linalg.norm(pool - window, axis=-1).mean((1, 2))
    return result


def _turned(joints: Float[np.ndarray, "F 24 3"]) -> Float[np.ndarray, "F 24 3"]:
    """Return relative to each frame's pelvis, the first frame facing +x."""
    across = joints[0, LEFT_HIP] - joints[0, RIGHT_HIP]
    yaw = np.arctan2(-across[0], across[1])  # the left hip is at +y of a body that faces +x
    c, s = np.cos(yaw), np.sin(yaw)
    offset = joints - joints[:, :1]
    x, y, z = np.moveaxis(offset, -1, 0)
    return np.stack([c * x + s * y, -s * x + c * y, z], -1)
