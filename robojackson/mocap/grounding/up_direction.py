"""The direction of up in the camera's axes.

A static camera has one direction of gravity for the whole clip. Straight edges of the scene show it
best (`scene_lines`). Without them it is estimated from balance (over a clip the centre of mass is,
on average, above the points that support it) and by the temporal network, and accepted only near
the camera's own up. World: x towards the camera, y to its right, z up; metres.
"""

import dataclasses
from typing import Literal

import numpy as np
from jaxtyping import Float

from robojackson.body.forward_kinematics import unit
from robojackson.config import config_dataclass
from robojackson.mocap.grounding.floor import centre_of_mass
from robojackson.mocap.grounding.scene_lines import SceneEvidence
from robojackson.mocap.temporal.ground_evidence import GroundEvidence

CAMERA_UP = np.array([0.0, -1.0, 0.0])
AXIS_WEIGHTS = np.array([1.0, 1.0, 0.4])
"""Weights of a speed's axes in the camera frame; depth from a single camera is mostly noise."""
LEAST_WEIGHT = 1e-4
ROUNDS = 6


@config_dataclass
class GravityConfig:
    """Weights of balance. Tuned on the nine bundled clips.

    Attributes:
        support_height_m: Height above the lowest foot point at which a point supports 1/e of its
            weight, metres.
        support_speed_mps: Speed at which a point supports 1/e of its weight, m/s.
        floor_sd_m: Spread of the height difference of two supporting feet, metres.
        roll_sd_deg, pitch_sd_deg: Spread of the angles of hand-held cameras, degrees; with the
            tails of a Cauchy distribution, so that a camera that balance finds far off level is not
            levelled.
        least_sd_deg: Least standard deviation of balance, degrees.
        beside_network_sd_deg: Least standard deviation of balance where the temporal network
            estimates gravity too, degrees.
        network_sd_factor: Ratio of the standard deviation of the network's up to the stated one.
        samples_per_s: Independent samples of balance a second.
        max_tilt_deg: Largest accepted angle between gravity and the camera's vertical, degrees.
        beside_network_max_tilt_deg: Largest accepted angle where the temporal network estimates
            gravity too, degrees.
        scene: Whether straight edges of the scene show gravity, and the focal length.
        scene_sd_deg: Largest standard deviation of up from the edges that is used, degrees.
        scene_sure_sd_deg: Largest one that is declared sure, degrees.
        scene_focal_sd: Largest standard deviation of the focal length from the edges that is used,
            a share of it.
    """

    support_height_m: float = 0.1
    support_speed_mps: float = 1.0
    floor_sd_m: float = 0.05
    roll_sd_deg: float = 2.5
    pitch_sd_deg: float = 10.0
    least_sd_deg: float = 1.5
    beside_network_sd_deg: float = 4.5
    network_sd_factor: float = 2.0
    samples_per_s: float = 1.0
    max_tilt_deg: float = 45.0
    beside_network_max_tilt_deg: float = 75.0
    scene: bool = True
    scene_sd_deg: float = 12.0
    scene_sure_sd_deg: float = 6.0
    scene_focal_sd: float = 0.1


@dataclasses.dataclass(frozen=True)
class Gravity:
    """The direction of up.

    Attributes:
        up: Unit vector against gravity, camera frame.
        source: Source of the direction.
        tilt_deg: Angle to the camera's own up, degrees.
        sd_deg: Standard deviation of its error, degrees; None where it is not known.
        sure: Whether it is declared sure: the scene shows it closely.
    """

    up: Float[np.ndarray, "3"]
    source: Literal["scene", "balance", "network", "camera"]
    tilt_deg: float
    sd_deg: float | None = None
    sure: bool = False


def find_up(
    points: Float[np.ndarray, "T 29 3"],
    feet: Float[np.ndarray, "T 4 3"],
    fps: float,
    config: GravityConfig,
    network: GroundEvidence | None = None,
    scene: SceneEvidence | None = None,
) -> Gravity:
    """Return up from the scene, else from balance and network, or the camera's own if they give an
    implausible one.

    Up is the least eigenvector of information matrices: the mean of the centre of mass above the
    supporting points is parallel to it; feet that both support differ across it; the camera is held
    about level; and the network's own up, with its spread. The weight of the first follows from its
    spread over the clip (a leaping dancer gives less information than a standing one) and from its
    distance to the network's: it fails more on steep cameras.

    Args:
        points: Keypoints, camera frame.
        feet: Heels and toes, camera frame.
        fps: Frames a second.
        config: Weights.
        network: What the temporal network found.
        scene: What straight edges of the scene show.
    """
    if scene is not None and scene.sd <= np.radians(config.scene_sd_deg):
        tilt, sure = _angle_deg(scene.up, CAMERA_UP), shows_up(scene, config)
        return Gravity(scene.up, "scene", tilt, float(np.degrees(scene.sd)), sure)

    def settled(start: np.ndarray, other: GroundEvidence | None, least_deg: float) -> np.ndarray:
        for _ in range(ROUNDS):
            start = _refined(start, points, feet, fps, config, other, least_deg)
        return start

    up, apart_deg = settled(CAMERA_UP, None, config.least_sd_deg), 0.0
    if network is not None:
        apart_deg = _angle_deg(up, network.up)
        least_deg = float(np.hypot(config.beside_network_sd_deg, apart_deg / 2.0))
        up = settled(network.up, network, least_deg)
    tilt = _angle_deg(up, CAMERA_UP)
    most_deg = config.max_tilt_deg if network is None else config.beside_network_max_tilt_deg
    if tilt > most_deg:
        return Gravity(CAMERA_UP, "camera", 0.0)
    if network is None:
        return Gravity(up, "balance", tilt)
    return Gravity(up, "network", tilt, spread_deg(apart_deg, network, config))


def shows_up(scene: SceneEvidence, config: GravityConfig) -> bool:
    """Return whether a scene shows up closely enough to be declared sure."""
    return bool(scene.sd <= np.radians(config.scene_sure_sd_deg))


def known_up(scene: SceneEvidence | None, config: GravityConfig) -> Float[np.ndarray, "3"] | None:
    """Return up where a scene shows it closely enough to be declared sure; None otherwise."""
    return scene.up if scene is not None and shows_up(scene, config) else None


def spread_deg(apart_deg: float, network: GroundEvidence, config: GravityConfig) -> float:
    """Return the standard deviation of up, degrees: that of both estimates together, and half of
    the angle between them, which shows their errors best.

    Args:
        apart_deg: Angle between the up of balance and that of the network, degrees.
        network: What the temporal network found.
        config: Weights.
    """
    spreads = config.beside_network_sd_deg, config.network_sd_factor * np.degrees(network.pitch_sd)
    together = 1.0 / np.hypot(1.0 / spreads[0], 1.0 / spreads[1])
    return float(np.hypot(together, apart_deg / 2.0))


def _angle_deg(one: np.ndarray, other: np.ndarray) -> float:
    return float(np.degrees(np.arccos(np.clip(one @ other, -1.0, 1.0))))


def _refined(
    up: np.ndarray,
    points: np.ndarray,
    feet: np.ndarray,
    fps: float,
    config: GravityConfig,
    network: GroundEvidence | None,
    least_deg: float,
) -> Float[np.ndarray, "3"]:
    weight = _carrying(up, feet, fps, config)
    total = weight.sum(1)
    share = total / total.sum()
    lean = centre_of_mass(points) - np.einsum("tk,tki->ti", weight, feet) / total[:, None]
    mean = share @ lean
    length = float(np.linalg.norm(mean))
    stray = lean - mean
    stray = stray - (stray @ up)[:, None] * up
    samples = max(1.0, len(feet) / fps * config.samples_per_s)
    spread = np.sqrt(share @ np.sum(stray**2, -1) / 2.0 / samples) / length
    spread = max(float(spread), np.radians(least_deg))
    information = (np.eye(3) - np.outer(mean, mean) / length**2) / spread**2
    information += _between_feet(weight, feet) / total.sum() / config.floor_sd_m**2
    information += np.diag(_level_prior(up, config))
    if network is not None:
        information += network.information() / config.network_sd_factor**2
    least = np.linalg.eigh(information)[1][:, 0]
    result: np.ndarray = least * np.sign(least @ mean)
    return result


def _carrying(
    up: np.ndarray, feet: np.ndarray, fps: float, config: GravityConfig
) -> Float[np.ndarray, "T 4"]:
    """Return the weight of each foot point: low and still ones support."""
    speed = np.linalg.norm(np.gradient(feet, axis=0) * fps * AXIS_WEIGHTS, axis=-1)
    height = feet @ up
    above = height - height.min(1, keepdims=True)
    still = np.exp(-((speed / config.support_speed_mps) ** 2))
    result: np.ndarray = still * np.exp(-above / config.support_height_m) + LEAST_WEIGHT
    return result


def _level_prior(up: np.ndarray, config: GravityConfig) -> Float[np.ndarray, "3"]:
    """Return the information of a camera held about level: the weight of a Cauchy prior at `up`."""
    spread = np.radians([config.roll_sd_deg, config.pitch_sd_deg])
    angle = np.arctan2(up[[0, 2]], -up[1])
    roll, pitch = 1.0 / (spread**2 + angle**2)
    return np.array([roll, 0.0, pitch])


def _between_feet(weight: np.ndarray, feet: np.ndarray) -> Float[np.ndarray, "3 3"]:
    """Return the second moment of left minus right foot over the frames in which both support."""
    each = weight.reshape(-1, 2, 2)
    place = np.einsum("tfp,tfpi->tfi", each, feet.reshape(-1, 2, 2, 3)) / each.sum(2)[..., None]
    apart = place[:, 0] - place[:, 1]
    result: np.ndarray = np.einsum("t,ti,tj->ij", each.sum(2).prod(1), apart, apart)
    return result


def camera_to_world(up: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3 3"]:
    """Return the rotation that maps `up` to z and the camera's backward direction to x."""
    back = np.array([0.0, 0.0, -1.0])
    x = unit(back - (back @ up) * up)
    return np.stack([x, np.cross(up, x), up])
