"""Faults of files that no body has made: a rest pose as the first frame, joints that jump away and
back. Both are in CMU's BVH files. Metres, seconds.
"""

from itertools import pairwise

import numpy as np
from jaxtyping import Float

JUMP_M_S = 15.0
"""Speed of a joint relative to the pelvis that no dancer reaches from one frame to the next."""
CALM = 0.5
"""Largest speed of the frames after a rest pose, and over a spike, as a share of the jump's."""
FRAMES = 10
"""Frames after the first that show whether it belongs to the motion."""
SPIKE_S = 0.2
"""Longest stay of a joint that jumps away and back, such as a knee that bends the wrong way."""


def mended(
    points: Float[np.ndarray, "T K 3"], fps: float
) -> tuple[Float[np.ndarray, "S K 3"], tuple[str, ...]]:
    """Return keypoints without faults, one frame less after a rest pose, and notes for the user.

    Args:
        points: Keypoints, the pelvis first, metres.
        fps: Frames a second.
    """
    notes = []
    if begins_at_rest(points, fps):
        points = points[1:]
        notes.append("first frame left out: a rest pose before the motion")
    points, spikes = without_spikes(points, fps)
    if spikes:
        frames = f"{spikes} of {len(points)} frames"
        notes.append(f"joints that jump away and back interpolated in {frames}")
    return points, tuple(notes)


def begins_at_rest(points: Float[np.ndarray, "T K 3"], fps: float) -> bool:
    """Return whether the joints jump from the first frame to the second and do not go on so."""
    if len(points) <= FRAMES:
        return False
    speed = np.linalg.norm(np.diff(points[: FRAMES + 1], axis=0), axis=-1).max(1) * fps
    return bool(speed[0] > JUMP_M_S and speed[1:].max() < CALM * speed[0])


def without_spikes(
    points: Float[np.ndarray, "T K 3"], fps: float
) -> tuple[Float[np.ndarray, "T K 3"], int]:
    """Return keypoints with jumps away and back interpolated, and the number of such frames."""
    relative = points - points[:, :1]
    speed = np.linalg.norm(np.diff(relative, axis=0), axis=-1) * fps
    bad = np.zeros(points.shape[:2], bool)
    for joint in np.flatnonzero((speed > JUMP_M_S).any(0)):
        mended_to = 0
        jumps = np.flatnonzero(speed[:, joint] > JUMP_M_S).tolist()
        for before, last in pairwise(jumps):
            away = relative[last + 1, joint] - relative[before, joint]
            calm = np.linalg.norm(away) < CALM * JUMP_M_S * (last + 1 - before) / fps
            if before >= mended_to and calm and last - before <= max(1, SPIKE_S * fps):
                bad[before + 1 : last + 1, joint] = True
                mended_to = last + 1
    frames, result = np.arange(len(points)), relative.copy()
    for joint in np.flatnonzero(bad.any(0)):
        good = ~bad[:, joint]
        for axis in range(3):
            result[:, joint, axis] = np.interp(frames, frames[good], relative[good, joint, axis])
    return result + points[:, :1], int(bad.any(1).sum())
