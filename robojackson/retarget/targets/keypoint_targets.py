"""Targets of the robot's keypoints: human bones keep their directions and take robot lengths.

The root is scaled by the ratio of the leg lengths and lifted or lowered until the lowest sole is on
the floor, unless the body is in free fall. Metres, seconds, world frame (z up, floor at z = 0).
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int

from robojackson.body.skeleton import KEYPOINT_NAMES
from robojackson.retarget.targets.foot_frames import foot_frames
from robojackson.retarget.targets.ground_contact import (
    ball_contact,
    free_fall,
    ground_shift,
    without,
)
from robojackson.retarget.targets.human_clip import HumanClip
from robojackson.robot.model import Robot

_HUMAN = {name: index for index, name in enumerate(KEYPOINT_NAMES)}
_LIMBS = (  # human bone -> robot bone; the hand follows the wrist: the robot has none
    (("hip", "knee"), ("hip", "knee")),
    (("knee", "ankle"), ("knee", "foot")),
    (("shoulder", "elbow"), ("shoulder", "elbow")),
    (("elbow", "wrist"), ("elbow", "hand")),
)
BONES: tuple[tuple[str, str], ...] = tuple(
    (f"{side}_{a}", f"{side}_{b}") for side in ("left", "right") for _, (a, b) in _LIMBS
)


@dataclass(frozen=True)
class Targets:
    """Targets of the solver.

    Attributes:
        keypoints_w: Targets of the robot's keypoints, metres.
        weights: Weight of each target in each step.
        contact: AIR, PLANTED or SLIDING for the robot's contact points.
        heading: Rotation matrices of the trunk: x forward, y left, z up along the trunk.
        dt: Seconds a step.
        cycle_offset: Displacement of one cycle, metres; None when the clip does not repeat.
        airborne: Steps in free fall.
        danced: Steps of the clip, where stands lead into and out of it; all when None.
    """

    keypoints_w: Float[np.ndarray, "N K 3"]
    weights: Float[np.ndarray, "N K"]
    contact: Int[np.ndarray, "N C"]
    heading: Float[np.ndarray, "N 3 3"]
    dt: float
    cycle_offset: Float[np.ndarray, "3"] | None
    airborne: Bool[np.ndarray, " N"]
    danced: Bool[np.ndarray, " N"] | None = None

    def __len__(self) -> int:
        return len(self.keypoints_w)


def targets(
    clip: HumanClip,
    robot: Robot,
    hovering: Bool[np.ndarray, " N"] | None = None,
    hops: bool = True,
) -> Targets:
    """Return the bone-direction targets, contact states of the soles and the ground refit.

    Args:
        clip: The human.
        robot: The robot.
        hovering: Steps of an earlier solution that claimed to fly and did not fall: their flights
            are taken back.
        hops: Whether a hop that is no flight stays one; else it is a step (`ball_contact`).
    """
    human = {name: clip.keypoints_w[:, index] for name, index in _HUMAN.items()}
    scale = leg_ratio(human, robot)
    points = _chain(human, robot, scale)
    feet = foot_frames(human, clip)
    for toe, arm in robot.toe_arms.items():
        side = toe.partition("_")[0]
        points[toe] = points[f"{side}_foot"] + feet[side] @ arm
    keypoints = np.stack([points[key] for key in robot.keypoint_names], axis=1)
    turns = [feet[point.side] for point in robot.description.contacts.values()]
    arms = np.stack([turn @ arm for turn, arm in zip(turns, robot.contact_arms, strict=True)], 1)
    balls = keypoints[:, robot.contact_keypoints] + arms
    airborne = free_fall(human, clip)
    if hovering is not None:
        airborne = without(airborne, hovering, clip.cycle_offset is not None)
    contact = ball_contact(clip, robot, balls, airborne, hops)
    soles = balls[..., 2] - robot.contact_radii
    keypoints[..., 2] += ground_shift(soles, contact, clip)[:, None]
    trust = np.where(clip.valid, 1.0, 0.2)[:, None]
    return Targets(
        keypoints_w=keypoints,
        weights=robot.keypoint_weights * trust,
        contact=contact,
        heading=trunk_frame(human),
        dt=clip.dt,
        cycle_offset=None if clip.cycle_offset is None else clip.cycle_offset * scale,
        airborne=airborne,
    )


def leg_ratio(human: Mapping[str, np.ndarray], robot: Robot) -> float:
    """Return robot leg over human leg, hip to sole; the lowest 2 % of ankles give the ankle's
    height."""
    length = robot.lengths
    robot_leg = length["left_hip", "left_knee"] + length["left_knee", "left_foot"]
    ankles = np.minimum(human["left_ankle"][:, 2], human["right_ankle"][:, 2])
    ankle_height = float(np.clip(np.quantile(ankles, 0.02), 0.03, 0.12))
    bones = [("hip", "knee"), ("knee", "ankle")]
    human_leg = sum(
        np.median(np.linalg.norm(human[f"{side}_{a}"] - human[f"{side}_{b}"], axis=1))
        for side in ("left", "right")
        for a, b in bones
    )
    return float((robot_leg + robot.sole_depth) / (human_leg / 2 + ankle_height))


def _chain(
    human: Mapping[str, np.ndarray], robot: Robot, scale: float
) -> dict[str, Float[np.ndarray, "N 3"]]:
    length = robot.lengths
    hips = (human["left_hip"] + human["right_hip"]) / 2
    chest = (human["left_shoulder"] + human["right_shoulder"]) / 2
    head = (human["head"] + human["head_top"]) / 2
    out = {"pelvis": hips * scale}
    shoulders = out["pelvis"] + _trunk_length(robot) * _unit(chest - hips)
    for joint, centre in (("hip", out["pelvis"]), ("shoulder", shoulders)):
        across = _unit(human[f"left_{joint}"] - human[f"right_{joint}"])
        half = length[f"left_{joint}", f"right_{joint}"] / 2
        out[f"left_{joint}"] = centre + half * across
        out[f"right_{joint}"] = centre - half * across
    for side in ("left", "right"):
        for (a, b), (c, d) in _LIMBS:
            aim = _unit(human[f"{side}_{b}"] - human[f"{side}_{a}"])
            bone = length[f"{side}_{c}", f"{side}_{d}"]
            out[f"{side}_{d}"] = out[f"{side}_{c}"] + bone * aim
    out["head"] = shoulders + _head_length(robot) * _unit(head - chest)
    return out


def _trunk_length(robot: Robot) -> float:
    """Return hip centre to shoulder centre: both are centres of mirrored pairs, so Pythagoras
    serves."""
    length = robot.lengths
    slope = length["left_hip", "left_shoulder"]
    half = (length["left_hip", "right_hip"] - length["left_shoulder", "right_shoulder"]) / 2
    return float(np.sqrt(slope**2 - half**2))


def _head_length(robot: Robot) -> float:
    slope = robot.lengths["left_shoulder", "head"]
    return float(np.sqrt(slope**2 - (robot.lengths["left_shoulder", "right_shoulder"] / 2) ** 2))


def trunk_frame(human: Mapping[str, np.ndarray]) -> Float[np.ndarray, "N 3 3"]:
    """Return x forward, y left, z up along the trunk, from hips and shoulders by name."""
    across = _unit(human["left_shoulder"] - human["right_shoulder"])
    hips = (human["left_hip"] + human["right_hip"]) / 2
    up = (human["left_shoulder"] + human["right_shoulder"]) / 2 - hips
    up = _unit(up - np.sum(up * across, -1, keepdims=True) * across)
    return np.stack([np.cross(across, up), across, up], axis=-1)


def every_second(clip_targets: Targets) -> Targets:
    """Return the same targets at half the rate."""
    return replace(select_steps(clip_targets, slice(None, None, 2)), dt=2 * clip_targets.dt)


def select_steps(
    clip_targets: Targets, steps: slice | Bool[np.ndarray, " N"] | Int[np.ndarray, " M"]
) -> Targets:
    """Return some of the steps, or all of them in another order."""
    danced = clip_targets.danced
    return replace(
        clip_targets,
        keypoints_w=clip_targets.keypoints_w[steps],
        weights=clip_targets.weights[steps],
        contact=clip_targets.contact[steps],
        heading=clip_targets.heading[steps],
        airborne=clip_targets.airborne[steps],
        danced=None if danced is None else danced[steps],
    )


def _unit(v: np.ndarray) -> np.ndarray:
    return np.asarray(v / np.maximum(np.linalg.norm(v, axis=-1, keepdims=True), 1e-9))
