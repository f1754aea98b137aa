"""Feet that turn on the floor: a pivot is no stand, neither heel nor toe keeps its place in it.

World frame, metres, radians. Order of the points: `motion.smpl_sequence.CONTACT_POINTS`.
"""

import numpy as np
from jaxtyping import Float

from robojackson.body.feet import stretches

HALF_WINDOW = np.radians(12.5)
"""Largest angle of a standing foot to the heading of its stand; tuned on dance_a and on synthetic
pivots."""
SHORTEST_STAND_S = 0.25
"""Time that a foot must stand between two turns."""


def turning(feet: Float[np.ndarray, "T 4 3"], planted: np.ndarray, fps: float) -> np.ndarray:
    """Return the frames in which the left and the right foot turn on the floor, shape (T, 2).

    Within each stretch of contact they are those in which the heading drags a window along both
    forth and back in time: not the ends of a turn, which are near the heading of a stand. So turns
    up to about five times `HALF_WINDOW` are no pivots.

    Args:
        feet: Foot points as the camera saw them, metres.
        planted: Whether each of them appears planted.
        fps: Frames a second.
    """
    found = np.zeros((len(feet), 2), bool)
    for side in range(2):
        sole = feet[:, 2 * side + 1] - feet[:, 2 * side]
        heading = np.asarray(np.unwrap(np.arctan2(sole[:, 1], sole[:, 0])))
        for start, end in stretches(np.any(planted[:, 2 * side : 2 * side + 2], axis=1)):
            here = heading[start:end]
            dragged = _drags(here) & _drags(here[::-1])[::-1]
            found[start:end, side] = _pivots(dragged, here, SHORTEST_STAND_S * fps)
    return found


def _drags(heading: Float[np.ndarray, " T"]) -> np.ndarray:
    """Return the frames in which a heading drags a window along, which begins where it holds the
    first headings as long as possible (a play operator)."""
    low, high = np.minimum.accumulate(heading), np.maximum.accumulate(heading)
    held = int(np.searchsorted(high - low, 2.0 * HALF_WINDOW, side="right"))
    middle = 0.5 * (low[held - 1] + high[held - 1])
    moved = np.zeros(len(heading), bool)
    for frame in range(held, len(heading)):
        near = np.clip(middle, heading[frame] - HALF_WINDOW, heading[frame] + HALF_WINDOW)
        moved[frame], middle = near != middle, near
    return moved


def _pivots(dragged: np.ndarray, heading: Float[np.ndarray, " T"], shortest: float) -> np.ndarray:
    """Return the turns with the stands between them that are too short, without those that hardly
    turn the foot."""
    turns = np.array(dragged)
    for start, end in stretches(~dragged):
        if start > 0 and end < len(turns) and end - start < shortest:
            turns[start:end] = True
    for start, end in stretches(turns):
        turns[start:end] = np.ptp(heading[max(start - 1, 0) : end + 1]) > HALF_WINDOW
    return turns
