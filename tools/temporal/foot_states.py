"""What is true of feet and gravity: the labels of the network's head for the ground.

States as `motion.smpl_sequence` has them, by the definition of `benchmarks/mocap/figures.py`: a
point is low over the floor that is refitted under the feet, and still along it. Metres, seconds.
"""

from itertools import pairwise

import numpy as np
from jaxtyping import Float, Int

from robojackson.mocap.grounding.floor import floor_height
from robojackson.motion.smpl_sequence import AIR, PLANTED, SLIDING

SOLE_BONES = ("foot.L", "toe1-2.L", "foot.R", "toe1-2.R")
SOLE_BELOW_BONE = np.array([0.08, 0.03, 0.08, 0.03])
"""Height of these bones of a standing body, metres, and"""
SOLE_LENGTH = 0.198
"""from heel bone to toe bone of the same body; others have feet in proportion."""
DOWN_M, UP_M = 0.045, 0.075
STILL_MPS, MOVING_MPS = 0.20, 0.35
SHORTEST_S = 0.1
FLOOR_HZ = 3.0


def soles(bones: Float[np.ndarray, "T B 3"], names: list[str]) -> Float[np.ndarray, "T 4 3"]:
    """Return the soles under heels and toes of a drawn body, world z up."""
    feet = np.array(bones[:, [names.index(name) for name in SOLE_BONES]], float)
    length = np.linalg.norm(feet[0, 1] - feet[0, 0])
    feet[..., 2] -= SOLE_BELOW_BONE * length / SOLE_LENGTH
    return feet


def states(feet: Float[np.ndarray, "T 4 3"], fps: float) -> Int[np.ndarray, "T 4"]:
    """Return AIR, PLANTED or SLIDING for every foot point; the lowest always touches."""
    grounded = np.zeros(len(feet), bool)
    floor = floor_height(feet[..., 2].min(1), grounded, fps, FLOOR_HZ)
    height = feet[..., 2] - floor[:, None]
    speed = np.linalg.norm(np.gradient(feet[..., :2], axis=0), axis=-1) * fps
    shortest = max(1, round(SHORTEST_S * fps))
    low = _steady(_held(height, DOWN_M, UP_M), shortest)
    still = _steady(_held(speed, STILL_MPS, MOVING_MPS), shortest)
    low |= height == height.min(1, keepdims=True)
    return np.where(~low, AIR, np.where(still, PLANTED, SLIDING)).astype(np.int8)


def level(points: Float[np.ndarray, "T N 3"], up: Float[np.ndarray, "3"]) -> np.ndarray:
    """Return points in axes whose z is up."""
    across = np.cross(up, [0.0, 0.0, 1.0])
    across /= np.linalg.norm(across)
    return np.asarray(points @ np.stack([across, np.cross(up, across), up]).T)


def _held(values: np.ndarray, on: float, off: float) -> np.ndarray:
    """Return True from a value below `on` until one above `off`, along axis 0."""
    decided = np.where(values < on, 1, np.where(values > off, 0, -1))
    decided[0] = np.where(decided[0] < 0, 1, decided[0])
    frames = np.arange(len(values))[:, None]
    last = np.maximum.accumulate(np.where(decided >= 0, frames, 0), axis=0)
    return np.take_along_axis(decided, last, axis=0).astype(bool)


def _steady(flags: np.ndarray, shortest: int) -> np.ndarray:
    """Give runs of fewer than `shortest` frames the value before them."""
    joined = flags.copy()
    for column in joined.T:
        edges = np.flatnonzero(np.diff(column)) + 1
        for start, end in pairwise(edges):
            if end - start < shortest:
                column[start:end] = column[start - 1]
    return joined
