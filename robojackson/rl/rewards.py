"""Reward terms of the tracking environment: pure functions of a state and its reference.

Each term is `weight * exp(-(error / width)^2)` (DeepMimic, Peng et al. 2018, eq. 3), so the reward
is greatest when the state equals the reference. Errors are in metres, radians and seconds; the
sites are compared relative to the pelvis, so that drifting over the floor costs only the drift
term.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from robojackson.geometry.rotations import quat_angle
from robojackson.rl.clip import ClipStep
from robojackson.rl.config import RewardConfig, TerminationConfig


@dataclass(frozen=True)
class TrackedPoints:
    """Which of the points are special: indices, bound by name.

    Attributes:
        pelvis: What the others are compared relative to.
        hands: Hands and head.
        limbs: Feet, hands and head: the ends that must not flail.
    """

    pelvis: int
    hands: tuple[int, ...]
    limbs: tuple[int, ...]


@dataclass(frozen=True)
class TrackingErrors:
    """How far each of N robots is from its reference.

    Attributes:
        joints: Root mean square over hinges, rad.
        joint_speed: Root mean square over hinges, rad/s.
        sites: Root mean square over sites relative to the pelvis, m.
        hands: The same over hands and head, m.
        site_mean: Mean distance of the sites relative to the pelvis, m.
        orientation: Of the root, rad.
        velocity: Of the root, m/s.
        limb_speed: Root mean square over the limb ends' velocity differences, m/s.
        height: Of the root, signed, m.
        drift: Of the root over the floor, m.
    """

    joints: Float[np.ndarray, " N"]
    joint_speed: Float[np.ndarray, " N"]
    sites: Float[np.ndarray, " N"]
    hands: Float[np.ndarray, " N"]
    site_mean: Float[np.ndarray, " N"]
    orientation: Float[np.ndarray, " N"]
    velocity: Float[np.ndarray, " N"]
    limb_speed: Float[np.ndarray, " N"]
    height: Float[np.ndarray, " N"]
    drift: Float[np.ndarray, " N"]


def tracking_errors(
    qpos: Float[np.ndarray, "N nq"],
    qvel: Float[np.ndarray, "N nv"],
    points: Float[np.ndarray, "N K 3"],
    moved: Float[np.ndarray, "N K 3"],
    target: ClipStep,
    which: TrackedPoints,
) -> TrackingErrors:
    """Compare states with their reference; `moved` is the velocity of the points, m/s."""
    relative = points - points[:, which.pelvis, None]
    wanted = target.points - target.points[:, which.pelvis, None]
    squared = np.sum((relative - wanted) ** 2, -1)
    limbs = list(which.limbs)
    hurry = np.sum((moved[:, limbs] - target.moved[:, limbs]) ** 2, -1)
    return TrackingErrors(
        joints=np.sqrt(np.mean((qpos[:, 7:] - target.qpos[:, 7:]) ** 2, -1)),
        joint_speed=np.sqrt(np.mean((qvel[:, 6:] - target.qvel[:, 6:]) ** 2, -1)),
        sites=np.sqrt(np.mean(squared, -1)),
        hands=np.sqrt(np.mean(squared[:, list(which.hands)], -1)),
        site_mean=np.mean(np.sqrt(squared), -1),
        orientation=quat_angle(qpos[:, 3:7], target.qpos[:, 3:7]),
        velocity=np.linalg.norm(qvel[:, :3] - target.qvel[:, :3], axis=-1),
        limb_speed=np.sqrt(np.mean(hurry, -1)),
        height=qpos[:, 2] - target.qpos[:, 2],
        drift=np.linalg.norm(qpos[:, :2] - target.qpos[:, :2], axis=-1),
    )


def reward_terms(
    errors: TrackingErrors, action_change: Float[np.ndarray, " N"], config: RewardConfig
) -> dict[str, Float[np.ndarray, " N"]]:
    """Named terms whose sum is the reward; `action_change` is the mean squared change."""
    fine, narrow = config.fine, config.narrow

    def bell(weight: float, error: np.ndarray, width: float) -> np.ndarray:
        square = (error / width) ** 2
        return weight * ((1 - fine) * np.exp(-square) + fine * np.exp(-square / narrow**2))

    return {
        "joints": bell(config.joints, errors.joints, config.joints_width),
        "sites": bell(config.sites, errors.sites, config.sites_width),
        "hands": bell(config.hands, errors.hands, config.hands_width),
        "orientation": bell(config.orientation, errors.orientation, config.orientation_width),
        "velocity": bell(config.velocity, errors.velocity, config.velocity_width),
        "joint_speed": bell(config.joint_speed, errors.joint_speed, config.joint_speed_width),
        "limb_speed": bell(config.limb_speed, errors.limb_speed, config.limb_speed_width),
        "height": bell(config.height, errors.height, config.height_width),
        "drift": bell(config.drift, errors.drift, config.drift_width),
        "action_rate": -config.action_rate * action_change,
    }


def fallen(qpos: Float[np.ndarray, "N nq"], config: TerminationConfig) -> Bool[np.ndarray, " N"]:
    """The paper's fall rule: the torso below 0.7 m or tilted over 60 degrees."""
    _, x, y, _ = qpos[:, 3:7].T
    upright = 1 - 2 * (x * x + y * y)
    return (qpos[:, 2] < config.fall_height) | (upright < np.cos(config.fall_tilt))


def lost(errors: TrackingErrors, config: TerminationConfig) -> Bool[np.ndarray, " N"]:
    """Early termination of training: too far from the reference to learn from."""
    return (
        (errors.orientation > config.orientation)
        | (np.abs(errors.height) > config.height)
        | (errors.site_mean > config.sites)
        | (errors.drift > config.drift)
    )
