"""The height of the floor under a body, and the body's centre of mass; metres, z up."""

import numpy as np
from jaxtyping import Float

from robojackson.body.feet import stretches
from robojackson.body.skeleton import KEYPOINT_NAMES, PART_RADII, keypoint, pair
from robojackson.body.smoothing import lowpass

GRAVITY = 9.81
FEET = ("ankle", "foot", "big_toe")
RADII: dict[int, float] = {
    index: PART_RADII[bare]
    for index, name in enumerate(KEYPOINT_NAMES)
    if (bare := name.removeprefix("left_").removeprefix("right_")) in PART_RADII.keys() - FEET
}
"""Parts other than feet that may carry the body: keypoint, radius in metres."""
UNDER_FEET_M = 0.2
"""Depth under the lowest foot at which another part of the body carries it, metres."""
OVER_FLOOR_M, AROUND_S = 0.3, 1.0
"""Largest height of that part over the floor under the feet, metres, within so many seconds."""


def centre_of_mass(points: Float[np.ndarray, "T 29 3"]) -> Float[np.ndarray, "T 3"]:
    """Return the whole-body centre from segment masses (Winter 2009, table 4.1, rounded)."""

    def middle(name: str) -> np.ndarray:
        result: np.ndarray = points[:, list(pair(name))].mean(1)
        return result

    def segment(start: str, end: str, part: float) -> np.ndarray:
        result: np.ndarray = middle(start) + part * (middle(end) - middle(start))
        return result

    trunk = 0.5 * (middle("hip") + middle("shoulder"))
    result: np.ndarray = (
        0.50 * trunk
        + 0.08 * points[:, keypoint("head")]
        + 0.20 * segment("hip", "knee", 0.43)
        + 0.09 * segment("knee", "ankle", 0.43)
        + 0.03 * middle("foot")
        + 0.056 * segment("shoulder", "elbow", 0.44)
        + 0.044 * segment("elbow", "wrist", 0.5)
    )
    return result


def lowest_part(points: Float[np.ndarray, "T 29 3"]) -> Float[np.ndarray, " T"]:
    """Return the height of the lowest part of the body that is no foot."""
    lowest: np.ndarray = (points[:, list(RADII), 2] - list(RADII.values())).min(1)
    return lowest


def off_feet(
    points: Float[np.ndarray, "T 29 3"],
    feet: Float[np.ndarray, "T 4 3"],
    falling: np.ndarray,
    fps: float,
) -> np.ndarray:
    """Return the frames in which another part carries the body: hands, head, back or knees.

    They are the stretches in which that part is under both feet, at some moment by far, and not
    higher than the floor on which the feet stand shortly before or after: whoever turns over in the
    air is not carried. As whole stretches they let the floor pass from feet to hands without a
    step.

    Args:
        points: Keypoints, metres.
        feet: Heels and toes, metres.
        falling: Frames of free fall.
        fps: Frames a second.
    """
    part, sole = lowest_part(points), feet[..., 2].min(1)
    under, found = sole - part, np.zeros(len(sole), bool)
    stands, around = (under <= 0.0) & ~falling, round(AROUND_S * fps)
    for start, end in stretches(under > 0.0):
        near = slice(max(start - around, 0), end + around)
        floor = sole[near][stands[near]].min(initial=np.inf)
        carries = np.median(part[start:end]) < floor + OVER_FLOOR_M
        found[start:end] = carries and under[start:end].max() > UNDER_FEET_M
    return found


def support_height(
    points: Float[np.ndarray, "T 29 3"], feet: Float[np.ndarray, "T 4 3"], elsewhere: np.ndarray
) -> Float[np.ndarray, " T"]:
    """Return the height of the lowest foot point, or of the lowest other part in the frames in
    which it carries the body."""
    return np.where(elsewhere, lowest_part(points), feet[..., 2].min(1))


def floor_height(
    lowest: Float[np.ndarray, " T"], flying: np.ndarray, fps: float, cutoff_hz: float
) -> Float[np.ndarray, " T"]:
    """Return the height of the floor under each frame: that of the lowest point, smoothed.

    Outside flight some point touches the floor in every frame. Through a flight the floor continues
    in a straight line.

    Args:
        lowest: Height of the lowest point that may carry the body (`support_height`), metres.
        flying: Frames of flight.
        fps: Frames a second.
        cutoff_hz: Cut-off of the smoothing, hertz.
    """
    frames = np.arange(len(lowest))
    grounded = ~flying
    if not grounded.any():
        return np.full(len(lowest), lowest.min())
    supported = np.interp(frames, frames[grounded], lowest[grounded])
    return lowpass(supported, fps, cutoff_hz)
