"""The ends of a clip that no body has danced: a cut, a fade, a person who leaves the picture.

There motion capture follows something else, and the person glides: the root moves fast although
feet touch the floor and none of them stands. No robot does that, and a motion that begins or ends
so cannot be danced. Metres, seconds, world frame.
"""

import logging

import numpy as np
from jaxtyping import Bool

from robojackson.body.skeleton import keypoint
from robojackson.motion.smpl_sequence import PLANTED, SLIDING, SmplSequence

GLIDE_M_S = 1.2
"""Speed of the root over the floor from which sliding feet are no dance: a moonwalk has 0.8."""
HOLE_S = 0.12
"""Frames without a glide between two with one that count as a part of it."""
MARGIN_S = 0.1
"""Left out beside a glide: its beginning is smoothed."""
MOST_SHARE = 0.3
"""Largest share of a clip that is left out; a clip that glides for longer stays whole."""

_log = logging.getLogger(__name__)


def gliding(sequence: SmplSequence) -> Bool[np.ndarray, " T"]:
    """Return the frames in which a person glides, or is not detected while it moves fast."""
    root = np.asarray(sequence.keypoints_w[:, keypoint("pelvis"), :2], float)
    speed = np.linalg.norm(np.gradient(root, 1.0 / sequence.fps, axis=0), axis=1)
    slides = (sequence.contact == SLIDING).any(1) & ~(sequence.contact == PLANTED).any(1)
    result: np.ndarray = (speed > GLIDE_M_S) & (slides | ~np.asarray(sequence.valid, bool))
    return result


def danced_frames(sequence: SmplSequence) -> slice:
    """Return the frames of a clip without glides at its beginning and its end."""
    count, hole = len(sequence), round(HOLE_S * sequence.fps)
    if count < 2:
        return slice(0, count)
    bad = gliding(sequence)
    margin = round(MARGIN_S * sequence.fps)
    begin, end = _end_of_glide(bad, hole, margin), count - _end_of_glide(bad[::-1], hole, margin)
    if begin + count - end > MOST_SHARE * count:
        return slice(0, count)
    if (begin, end) != (0, count):
        _log.info(
            "left out %.2f s at the beginning and %.2f s at the end: the person glides over the "
            "floor, which a cut or a fade looks like (retarget.cut_glides: no keeps them)",
            begin / sequence.fps, (count - end) / sequence.fps,
        )  # fmt: skip
    return slice(begin, end)


def _end_of_glide(bad: Bool[np.ndarray, " T"], hole: int, margin: int) -> int:
    """Return how many frames at the beginning belong to a glide."""
    end = 0
    for frame in np.flatnonzero(bad):
        if frame > end + hole:
            break
        end = int(frame) + 1
    return min(end + margin, len(bad)) if end else 0
