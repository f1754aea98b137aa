"""Contacts of heels and toes with the floor: AIR, PLANTED or SLIDING.

A point is low or not, and still or not, each with hysteresis, so that a value between the two
thresholds changes nothing. Metres, seconds; floor at z = 0. Order: `motion.smpl.CONTACT_POINTS`.
"""

from itertools import pairwise

import numpy as np
from jaxtyping import Float, Int
from pydantic import ConfigDict
from pydantic.dataclasses import dataclass

from robojackson.motion.smpl import AIR, PLANTED, SLIDING


@dataclass(frozen=True, config=ConfigDict(extra="forbid"))
class ContactConfig:
    """When a foot point stands.

    Attributes:
        touch_m, leave_m: A point below the first height is down; above the second it is up, metres.
        still_mps, moving_mps: Below the first speed it stands; above the second it slides, m/s.
        depth_weight: Part of the speed along the camera's axis that counts; a single camera hardly
            sees it.
        min_s: A state shorter than this is joined to the one before it, seconds.
    """

    touch_m: float = 0.045
    leave_m: float = 0.075
    still_mps: float = 0.20
    moving_mps: float = 0.35
    depth_weight: float = 0.4
    min_s: float = 0.1


def contacts(
    feet: Float[np.ndarray, "T 4 3"], falling: np.ndarray, fps: float, config: ContactConfig
) -> Int[np.ndarray, "T 4"]:
    """State of every point in every frame; outside free fall the lowest point is never AIR."""
    height = feet[..., 2]
    low = hysteresis(height, config.touch_m, config.leave_m)
    speed = foot_speed(feet, fps, config.depth_weight)
    still = hysteresis(speed, config.still_mps, config.moving_mps)
    shortest = max(1, round(config.min_s * fps))
    low, still = join_short(low, shortest), join_short(still, shortest)
    low |= (height == height.min(1, keepdims=True)) & ~falling[:, None]
    return np.where(~low, AIR, np.where(still, PLANTED, SLIDING)).astype(np.int8)


def foot_speed(
    feet: Float[np.ndarray, "T 4 3"], fps: float, depth_weight: float
) -> Float[np.ndarray, "T 4"]:
    """Speed of each point, m/s; motion along x (the camera's axis) counts by its weight."""
    if len(feet) < 2:
        return np.zeros(feet.shape[:2])
    velocity = np.gradient(feet, axis=0) * fps
    return np.linalg.norm(velocity * np.array([depth_weight, 1.0, 1.0]), axis=-1)


def hysteresis(values: np.ndarray, on: float, off: float) -> np.ndarray:
    """True from a value below `on` until one above `off`; undecided beginnings look at `off`."""
    decided = np.where(values < on, 1, np.where(values > off, 0, -1))
    decided[0] = np.where(decided[0] < 0, 1, decided[0])
    frames = np.arange(len(values)).reshape(-1, *([1] * (values.ndim - 1)))
    last = np.maximum.accumulate(np.where(decided >= 0, frames, 0), axis=0)
    return np.take_along_axis(decided, last, axis=0).astype(bool)


def join_short(states: np.ndarray, shortest: int) -> np.ndarray:
    """Runs of fewer than `shortest` frames along axis 0 take the state before them."""
    joined = states.copy()
    for column in joined.reshape(len(joined), -1).T:
        edges = np.flatnonzero(np.diff(column)) + 1
        for start, end in pairwise(edges):
            if end - start < shortest:
                column[start:end] = column[start - 1]
    return joined
