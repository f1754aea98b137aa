"""Twist of each bone from the landmarks: hinge planes, palms, face and shoulder line.

A joint's cue is a direction in the rest pose that must coincide, in the projection along the bone,
with a measured direction: with a bent knee the shin determines the twist of the thigh. Where a cue
fades (a straight limb) a measured prior replaces it: the median twist of 763 frames of HybrIK,
radians.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from robojackson.body.analytic_solve import TwistRule
from robojackson.body.forward_kinematics import apply, unit
from robojackson.body.skeleton import AIM_CHILD, JOINT_NAMES, keypoint
from robojackson.mocap.landmarks.blazepose import landmark
from robojackson.mocap.pose.keypoints import LEFT, UP, Keypoints

FORWARD = np.array([0.0, 0.0, 1.0])
PRIOR_DEG: Mapping[str, float] = {
    "left_hip": -3, "right_hip": 1, "left_knee": 1, "right_knee": -2, "left_ankle": -11,
    "right_ankle": 11, "left_foot": 14, "right_foot": -14, "left_shoulder": 17,
    "right_shoulder": -14, "left_elbow": 7, "right_elbow": -2, "left_wrist": 1, "right_wrist": -1,
    "left_hand": -8, "right_hand": 8, "neck": -4, "head": -2,
}  # fmt: skip
PRIOR = np.radians([PRIOR_DEG.get(name, 0.0) for name in JOINT_NAMES])
FLEXION_DEG = (15.0, 35.0)
"""Flexions of a hinge below which it gives no information on twist, and above which full
information."""
PALM_WEIGHT = 0.7
FOOT_WEIGHT = 0.5
LIMIT_DEG: Mapping[str, float] = {
    "hip": 60.0, "knee": 30.0, "ankle": 30.0, "shoulder": 110.0, "elbow": 100.0,
}  # fmt: skip
"""Largest twist away from the prior: the limit of a person's joints."""
OTHER_LIMIT_DEG = 60.0
FADE = np.radians(30.0)
"""Angle to the opposite direction within which the cue's sign is unknown."""


@dataclass(frozen=True)
class Cue:
    """Measured direction of one joint's twist.

    Attributes:
        rest: Direction in the rest pose.
        measured: The same direction as measured, metres or unit.
        weight: Weight of the measurement against the prior, 0..1.
    """

    rest: Float[np.ndarray, "3"]
    measured: Float[np.ndarray, "T 3"]
    weight: Float[np.ndarray, " T"]


def cues(keypoints: Keypoints, landmarks: Float[np.ndarray, "T 33 3"]) -> dict[str, Cue]:
    """Return the cue of every joint that has one."""
    always = np.ones(len(landmarks))
    found = {
        name: Cue(LEFT, _between(keypoints.pelvis, keypoints.chest, share), always)
        for name, share in (("spine1", 1 / 3), ("spine2", 2 / 3), ("spine3", 1.0))
    }
    found["neck"] = Cue(LEFT, _between(keypoints.chest, keypoints.head, 0.5), always)
    found["head"] = Cue(LEFT, _between(keypoints.chest, keypoints.head, 1.0), always)
    for side in ("left", "right"):
        found |= _limb_cues(keypoints.points, landmarks, side)
    return found


def level_cues(found: Mapping[str, Cue], level: Float[np.ndarray, "T 2"]) -> dict[str, Cue]:
    """Return cues of the ankles of which the given share comes from a level floor; world frame."""
    above = np.array([0.0, 0.0, 1.0])
    changed = {}
    for side, name in enumerate(("left_ankle", "right_ankle")):
        cue, share = found[name], level[:, side]
        seen = unit(cue.measured) + share[:, None] * (above - unit(cue.measured))
        changed[name] = Cue(cue.rest, seen, cue.weight + share * (1.0 - cue.weight))
    return changed


def rule(found: Mapping[str, Cue], rest_joints: Float[np.ndarray, "29 3"]) -> TwistRule:
    """Return the twist rule of `analytic_solve.solve_with` that follows the cues."""

    def decide(joint: int, swung: np.ndarray) -> np.ndarray:
        name = JOINT_NAMES[joint]
        angle = np.full(len(swung), PRIOR[joint])
        if name in found:
            bone = rest_joints[AIM_CHILD[joint]] - rest_joints[joint]
            cue = found[name]
            angle = _blend(name, PRIOR[joint], cue_angle(cue, bone, swung), cue.weight)
        return np.stack([np.cos(angle), np.sin(angle)], -1)

    return decide


def prior() -> Float[np.ndarray, "23 2"]:
    """Return (cos, sin) of the prior twist of joints 1..23."""
    return np.stack([np.cos(PRIOR[1:]), np.sin(PRIOR[1:])], -1)


def _limb_cues(points: np.ndarray, landmarks: np.ndarray, side: str) -> dict[str, Cue]:
    def point(name: str) -> np.ndarray:
        return points[:, keypoint(f"{side}_{name}")]

    def mark(name: str) -> np.ndarray:
        return landmarks[:, landmark(f"{side}_{name}")]

    shin, thigh = point("ankle") - point("knee"), point("knee") - point("hip")
    fore, upper = point("wrist") - point("elbow"), point("elbow") - point("shoulder")
    sole = (mark("heel") - mark("foot_index"), mark("ankle") - mark("foot_index"))
    foot = np.cross(np.cross(*sole), sole[0])
    seen = np.full(len(points), 1.0)
    return {
        f"{side}_hip": Cue(-FORWARD, shin, _bent(thigh, shin)),
        f"{side}_shoulder": Cue(FORWARD, fore, _bent(upper, fore)),
        f"{side}_elbow": Cue(FORWARD, mark("index") - mark("pinky"), seen * PALM_WEIGHT),
        f"{side}_ankle": Cue(UP, foot, seen * FOOT_WEIGHT),
    }


def _bent(upper: np.ndarray, lower: np.ndarray) -> Float[np.ndarray, " T"]:
    """Return 0 for a straight hinge, 1 for a bent one, smooth between the two flexions."""
    cosine = np.sum(unit(upper) * unit(lower), -1)
    flexion = np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))
    start, full = FLEXION_DEG
    part = np.clip((flexion - start) / (full - start), 0.0, 1.0)
    result: np.ndarray = part * part * (3.0 - 2.0 * part)
    return result


def _between(first: np.ndarray, second: np.ndarray, share: float) -> Float[np.ndarray, "T 3"]:
    """Return the left direction of a frame part of the way from one frame to another."""
    return unit((1.0 - share) * apply(first, LEFT) + share * apply(second, LEFT))


def cue_angle(cue: Cue, bone: np.ndarray, swung: np.ndarray) -> Float[np.ndarray, " T"]:
    """Return the signed turn about the bone from the rest direction to the measured one."""
    axis = unit(bone)
    measured = apply(np.swapaxes(swung, -1, -2), cue.measured)
    flat = cue.rest - (cue.rest @ axis) * axis
    sine = np.sum(np.cross(flat, measured) * axis, -1)
    cosine = np.sum(flat * measured, -1)
    result: np.ndarray = np.arctan2(sine, cosine)
    return result


def _blend(name: str, prior_angle: float, angle: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Return the prior plus the weighted, limited difference; a cue that points backwards fades
    out."""
    bare = name.removeprefix("left_").removeprefix("right_")
    limit = np.radians(LIMIT_DEG.get(bare, OTHER_LIMIT_DEG))
    difference = (angle - prior_angle + np.pi) % (2.0 * np.pi) - np.pi
    fade = np.clip((np.pi - np.abs(difference)) / FADE, 0.0, 1.0)
    result: np.ndarray = prior_angle + weight * fade * np.clip(difference, -limit, limit)
    return result
