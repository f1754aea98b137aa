"""The skeleton: names and tree of HybrIK's 29 keypoints, of which the first 24 are SMPL's joints.

Order as in HybrIK (Li et al., CVPR 2021): the 24 joints of SMPL (Loper et al. 2015), then five leaf
points that give head, hands and feet a bone to aim along. The rest pose is our own, rounded and
symmetric: a T-pose with x to the person's left, y up, z forward, metres.
"""

import numpy as np
from jaxtyping import Float

from robojackson.errors import UnknownName

KEYPOINT_NAMES: tuple[str, ...] = (
    "pelvis", "left_hip", "right_hip", "spine1", "left_knee", "right_knee", "spine2", "left_ankle",
    "right_ankle", "spine3", "left_foot", "right_foot", "neck", "left_collar", "right_collar",
    "head", "left_shoulder", "right_shoulder", "left_elbow", "right_elbow", "left_wrist",
    "right_wrist", "left_hand", "right_hand", "head_top", "left_middle", "right_middle",
    "left_big_toe", "right_big_toe",
)  # fmt: skip
JOINT_NAMES: tuple[str, ...] = KEYPOINT_NAMES[:24]
PARENTS: tuple[int, ...] = (
    -1, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 9, 9, 12, 13, 14, 16, 17, 18, 19, 20, 21, 15, 22, 23,
    10, 11,
)  # fmt: skip

AIM_CHILD: tuple[int, ...] = (
    3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 27, 28, 15, 16, 17, 24, 18, 19, 20, 21, 22, 23, 25, 26,
)  # fmt: skip
"""The child that the bone of joint 0..23 aims at; only the pelvis uses several."""

_LEFT_OFFSETS: dict[str, tuple[float, float, float]] = {
    "hip": (0.09, -0.09, 0.0),
    "knee": (0.02, -0.40, 0.0),
    "ankle": (0.0, -0.41, -0.03),
    "foot": (0.01, -0.06, 0.13),
    "big_toe": (0.0, -0.01, 0.07),
    "collar": (0.08, 0.12, 0.0),
    "shoulder": (0.10, 0.03, 0.0),
    "elbow": (0.27, 0.0, 0.0),
    "wrist": (0.25, 0.0, 0.0),
    "hand": (0.08, 0.0, 0.0),
    "middle": (0.10, 0.0, 0.0),
}
_MIDDLE_OFFSETS: dict[str, tuple[float, float, float]] = {
    "pelvis": (0.0, 0.0, 0.0),
    "spine1": (0.0, 0.11, -0.02),
    "spine2": (0.0, 0.13, 0.0),
    "spine3": (0.0, 0.05, 0.0),
    "neck": (0.0, 0.21, 0.0),
    "head": (0.0, 0.08, 0.04),
    "head_top": (0.0, 0.19, 0.0),
}
"""Our own rounded adult of 1.75 m in T-pose, palms down, offsets from the parent, metres."""

HEEL_OFFSET = np.array([0.0, -0.08, -0.05])
"""Bottom of the heel in the frame of the ankle, metres; both sides."""
SOLE_BELOW_TOE = 0.01
"""Thickness of the foot under the big toe's point, metres."""

PART_RADII: dict[str, float] = {
    "hip": 0.085, "spine1": 0.105, "spine2": 0.11, "spine3": 0.115, "knee": 0.072, "ankle": 0.048,
    "foot": 0.042, "neck": 0.1, "head": 0.052, "collar": 0.075, "shoulder": 0.07, "elbow": 0.043,
    "wrist": 0.035, "hand": 0.032, "head_top": 0.1, "middle": 0.022, "big_toe": 0.032,
}  # fmt: skip
"""Radius of the rounded part that ends at a keypoint, metres, by its name without the side: a body
to look at."""


def side_of(name: str) -> str:
    """Return left, right or middle."""
    side = name.partition("_")[0]
    return side if side in ("left", "right") else "middle"


def part_radius(name: str) -> float:
    """Return the radius of the part that ends at a keypoint, metres."""
    return PART_RADII[name.removeprefix("left_").removeprefix("right_")]


def keypoint(name: str) -> int:
    """Return the index of a keypoint; an unknown name raises `UnknownName` with the known ones."""
    if name not in KEYPOINT_NAMES:
        raise UnknownName("keypoint", name, "body.skeleton", KEYPOINT_NAMES)
    return KEYPOINT_NAMES.index(name)


def pair(name: str) -> tuple[int, int]:
    """Return the indices of the left and the right keypoint of a name without its side."""
    return keypoint(f"left_{name}"), keypoint(f"right_{name}")


def rest_offset(name: str) -> Float[np.ndarray, "3"]:
    """Return the offset of a keypoint from its parent in the rest pose, metres."""
    side, _, bare = name.partition("_")
    if side == "right":
        return np.array(_LEFT_OFFSETS[bare]) * [-1.0, 1.0, 1.0]
    return np.array(_LEFT_OFFSETS[bare] if side == "left" else _MIDDLE_OFFSETS[name])


REST_OFFSETS: Float[np.ndarray, "29 3"] = np.stack([rest_offset(n) for n in KEYPOINT_NAMES])


def assemble(offsets: Float[np.ndarray, "29 3"]) -> Float[np.ndarray, "29 3"]:
    """Return the positions of the keypoints of a rest pose from their offsets, pelvis at its own
    offset."""
    points = np.array(offsets, dtype=float)
    for index, parent in enumerate(PARENTS):
        if parent >= 0:
            points[index] += points[parent]
    return points


REST_JOINTS: Float[np.ndarray, "29 3"] = assemble(REST_OFFSETS)
