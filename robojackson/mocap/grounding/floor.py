"""The height of the floor under a body, and the body's centre of mass; metres, z up."""

import numpy as np
from jaxtyping import Float

from robojackson.body.skeleton import keypoint, pair
from robojackson.body.smoothing import lowpass

GRAVITY = 9.81


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


def floor_height(
    lowest: Float[np.ndarray, " T"], flying: np.ndarray, fps: float, cutoff_hz: float
) -> Float[np.ndarray, " T"]:
    """Return the height of the floor under each frame: that of the lowest foot point, smoothed.

    Outside flight some point touches the floor in every frame. Through a flight the floor continues
    in a straight line.
    """
    frames = np.arange(len(lowest))
    grounded = ~flying
    if not grounded.any():
        return np.full(len(lowest), lowest.min())
    supported = np.interp(frames, frames[grounded], lowest[grounded])
    return lowpass(supported, fps, cutoff_hz)
