"""The person's skeleton: one symmetric length a bone for the whole clip.

A length is the median over the clip of the mean of left and right, moved towards the proportions of
our rest skeleton: BlazePose's shins are 10-20 % short in every clip with a ground truth. Metres.
"""

from collections.abc import Mapping

import numpy as np
from jaxtyping import Float

from robojackson.body.skeleton import KEYPOINT_NAMES, REST_JOINTS, REST_OFFSETS, assemble, keypoint
from robojackson.mocap.landmarks.blazepose import landmark

MEASURED: Mapping[str, tuple[tuple[str, str], tuple[str, str], tuple[str, ...]]] = {
    "thigh": (("hip", "knee"), ("hip", "knee"), ("knee",)),
    "shin": (("knee", "ankle"), ("knee", "ankle"), ("ankle",)),
    "foot": (("ankle", "foot_index"), ("ankle", "big_toe"), ("foot", "big_toe")),
    "upper_arm": (("shoulder", "elbow"), ("shoulder", "elbow"), ("elbow",)),
    "forearm": (("elbow", "wrist"), ("elbow", "wrist"), ("wrist", "hand", "middle")),
    "flank": (("shoulder", "hip"), ("shoulder", "hip"), ()),
}
"""Group -> landmarks, keypoints of the rest pose, and the points whose offsets it scales."""
ACROSS: Mapping[str, tuple[str, tuple[str, ...]]] = {
    "hips": ("hip", ("hip",)),
    "shoulders": ("shoulder", ("collar", "shoulder")),
}
"""Width -> landmark on both sides, and the points whose sideways offset it scales."""


def fit_skeleton(points: Float[np.ndarray, "T 33 3"], trust: float) -> Float[np.ndarray, "29 3"]:
    """Return the rest joints of the person.

    Args:
        points: Landmarks, metres, any frame.
        trust: 0 uses the proportions of the rest skeleton at the person's size, 1 the medians.
    """
    ratios = {name: _along(points, *pairs[:2]) for name, pairs in MEASURED.items()}
    ratios |= {name: _across(points, pair[0]) for name, pair in ACROSS.items()}
    size = float(np.median(list(ratios.values())))
    scale = {name: size * (ratio / size) ** trust for name, ratio in ratios.items()}
    offsets = REST_OFFSETS * size
    for index, name in enumerate(KEYPOINT_NAMES):
        bare = name.removeprefix("left_").removeprefix("right_")
        offsets[index] = _scaled(bare, REST_OFFSETS[index], scale)
    return assemble(offsets)


def _scaled(bare: str, offset: np.ndarray, scale: Mapping[str, float]) -> np.ndarray:
    for group, (_, _, members) in MEASURED.items():
        if bare in members:
            return offset * scale[group]
    for group, (_, members) in ACROSS.items():
        if bare in members:
            result: np.ndarray = offset * np.array([scale[group], scale["flank"], scale["flank"]])
            return result
    return offset * scale["flank"]


def _along(points: np.ndarray, marks: tuple[str, str], joints: tuple[str, str]) -> float:
    """Return the median measured length over the rest length."""
    measured = [_distance(points, f"{s}_{marks[0]}", f"{s}_{marks[1]}") for s in ("left", "right")]
    start, end = (REST_JOINTS[keypoint(f"left_{name}")] for name in joints)
    return float(np.median(np.mean(measured, 0)) / np.linalg.norm(end - start))


def _across(points: np.ndarray, mark: str) -> float:
    measured = np.median(_distance(points, f"left_{mark}", f"right_{mark}"))
    return float(measured / (2.0 * REST_JOINTS[keypoint(f"left_{mark}"), 0]))


def _distance(points: np.ndarray, start: str, end: str) -> np.ndarray:
    result: np.ndarray = np.linalg.norm(
        points[:, landmark(end)] - points[:, landmark(start)], axis=-1
    )
    return result
