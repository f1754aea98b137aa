"""Orientation of the human's feet, for robots with soles instead of balls.

A foot points from the ankle to the big toe. How far that line slopes when the sole is flat depends
on the skeleton, so it is measured where heel and toe are both planted. World frame, metres.
"""

from collections.abc import Mapping

import numpy as np
from jaxtyping import Float

from robojackson.body.feet import REST_SLOPE
from robojackson.motion.smpl_sequence import CONTACT_POINTS, PLANTED
from robojackson.retarget.targets.human_clip import HumanClip

_ENOUGH = 5  # frames on a flat foot from which its slope is measured


def foot_frames(
    human: Mapping[str, np.ndarray], clip: HumanClip
) -> dict[str, Float[np.ndarray, "N 3 3"]]:
    """Return the rotation of each foot from standing upright along x: columns forward, left, up."""
    out = {}
    for side in ("left", "right"):
        ankle, toe = human[f"{side}_ankle"], human[f"{side}_big_toe"]
        shin = human[f"{side}_knee"] - ankle
        flat = _flat_slope(toe - ankle, clip, side)
        out[side] = _frames(toe - ankle, shin, flat)
    return out


def _flat_slope(aim: Float[np.ndarray, "N 3"], clip: HumanClip, side: str) -> float:
    """Return the downward slope of ankle to toe on a flat sole, radians."""
    own = [index for index, name in enumerate(CONTACT_POINTS) if name.startswith(side)]
    standing = (clip.contact[:, own] == PLANTED).all(axis=1)
    if standing.sum() < _ENOUGH:
        return REST_SLOPE
    slope = np.arctan2(-aim[standing, 2], np.linalg.norm(aim[standing, :2], axis=1))
    return float(np.median(slope))


def _frames(
    aim: Float[np.ndarray, "N 3"], shin: Float[np.ndarray, "N 3"], flat: float
) -> Float[np.ndarray, "N 3 3"]:
    """Turn the line to the toe up by the slope of a flat foot, in the plane of the shin."""
    aim = _unit(aim)
    left = _unit(np.cross(shin, aim))
    up = np.cross(aim, left)
    forward = np.cos(flat) * aim + np.sin(flat) * up
    return np.stack([forward, left, np.cross(forward, left)], axis=-1)


def _unit(v: np.ndarray) -> np.ndarray:
    return np.asarray(v / np.maximum(np.linalg.norm(v, axis=-1, keepdims=True), 1e-9))
