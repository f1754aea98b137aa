"""Contacts of heels and toes with the floor: AIR, PLANTED or SLIDING, by a hidden Markov model.

Each of the four points has three states; a touching point is low over the refitted floor, a planted
one is also still in the image and, as far as a single camera can measure it, along the ray: a
person who walks towards the camera hardly moves in the image. All 81 joint states are evaluated
together because of a constraint: outside free fall the body is supported, so that all four in the
air is impossible there unless another part carries it. The most probable path is found by dynamic
programming (Viterbi 1967). Metres, seconds; floor at z = 0. Order:
`motion.smpl_sequence.CONTACT_POINTS`.
"""

from itertools import product, repeat

import numpy as np
from jaxtyping import Float, Int

from robojackson.body.forward_kinematics import unit
from robojackson.config import config_dataclass
from robojackson.geometry.shortest_path import viterbi
from robojackson.motion.smpl_sequence import AIR, CONTACT_POINTS, PLANTED, SLIDING

STATES = (AIR, PLANTED, SLIDING)
JOINT = np.array(list(product(STATES, repeat=len(CONTACT_POINTS))))
"""The 81 joint states, (81, 4)."""
IMPOSSIBLE = -1e9


@config_dataclass
class ContactConfig:
    """Distributions of the states. Tuned on dance_a, dance_b and walk.

    Attributes:
        touch_sd_m: Height of a touching point over the refitted floor, standard deviation, metres.
        air_sd_m: Height of a point in the air, standard deviation, metres.
        still_sd_mps: Speed in the image of a planted point, one axis, metres a second.
        moving_sd_mps: Speed in the image of any other point, one axis, metres a second.
        still_along_sd_mps: Speed of a planted point along the ray, mostly noise, metres a second.
        moving_along_sd_mps: Speed of any other point along the ray, metres a second.
        outlier: Share of measurements without information.
        samples_per_s: Independent measurements a second.
        change: Cost of a change of one point's state, nats.
    """

    touch_sd_m: float = 0.04
    air_sd_m: float = 0.2
    still_sd_mps: float = 0.2
    moving_sd_mps: float = 1.5
    still_along_sd_mps: float = 0.6
    moving_along_sd_mps: float = 1.8
    outlier: float = 0.02
    samples_per_s: float = 10.0
    change: float = 1.0


def contacts(
    height: Float[np.ndarray, "T 4"],
    speed: Float[np.ndarray, "T 4"],
    unsupported: np.ndarray,
    fps: float,
    config: ContactConfig,
    along: Float[np.ndarray, "T 4"] | None = None,
) -> Int[np.ndarray, "T 4"]:
    """Return the most probable state of every point in every frame; one is never AIR where the feet
    must carry the body.

    Args:
        height: Height of the points over the floor, metres.
        speed: Speed in the image at the person's distance (`image_speed`), m/s.
        unsupported: Frames in which no foot has to carry the body: of free fall, and those in which
            another part does.
        fps: Frames a second.
        config: Settings of the model.
        along: Speed along the ray (`ray_speed`), m/s; None where unknown.
    """
    weight = min(1.0, config.samples_per_s / fps)
    single = weight * log_likelihood(height, speed, config, along)
    points = np.arange(len(CONTACT_POINTS))
    joint = single[:, points, JOINT].sum(-1)
    airborne = (JOINT == AIR).all(1)
    joint[np.ix_(~np.asarray(unsupported, bool), airborne)] = IMPOSSIBLE
    changes = (JOINT[:, None] != JOINT[None]).sum(-1)
    path = viterbi(-joint, repeat(config.change * changes, len(joint) - 1))
    result: np.ndarray = JOINT[path].astype(np.int8)
    return result


def log_likelihood(
    height: Float[np.ndarray, "T 4"],
    speed: Float[np.ndarray, "T 4"],
    config: ContactConfig,
    along: Float[np.ndarray, "T 4"] | None = None,
) -> Float[np.ndarray, "T 4 3"]:
    """Return the log likelihood of one frame's height and speed in each state, up to a constant.

    Heights are half normal, image speeds Rayleigh without the factor that all states share; an
    outlier has the distribution of a point in the air or in motion. A raised foot is as often still
    as not.
    """
    up = np.maximum(height, 0.0)
    loose = _normal(up, config.air_sd_m, 1)
    touching = (1.0 - config.outlier) * _normal(up, config.touch_sd_m, 1) + config.outlier * loose
    moving = _normal(speed, config.moving_sd_mps, 2)
    still = _normal(speed, config.still_sd_mps, 2)
    if along is not None:
        moving = moving * _normal(along, config.moving_along_sd_mps, 1)
        still = still * _normal(along, config.still_along_sd_mps, 1)
    still = (1.0 - config.outlier) * still
    still = still + config.outlier * moving
    raised = 0.5 * (still + moving)
    result: np.ndarray = np.log(np.stack([loose * raised, touching * still, touching * moving], -1))
    return result


def image_speed(points_c: Float[np.ndarray, "T 4 3"], fps: float) -> Float[np.ndarray, "T 4"]:
    """Return the speed across the ray from the camera at the origin, m/s."""
    if len(points_c) < 2:
        return np.zeros(points_c.shape[:2])
    velocity = np.gradient(points_c, axis=0) * fps
    ray = unit(points_c)
    along = np.sum(velocity * ray, -1, keepdims=True) * ray
    return np.asarray(np.linalg.norm(velocity - along, axis=-1))


def ray_speed(points_c: Float[np.ndarray, "T 4 3"], fps: float) -> Float[np.ndarray, "T 4"]:
    """Return the speed of the distance from the camera at the origin, m/s; not signed."""
    if len(points_c) < 2:
        return np.zeros(points_c.shape[:2])
    return np.asarray(np.abs(np.gradient(np.linalg.norm(points_c, axis=-1), axis=0)) * fps)


def _normal(values: np.ndarray, spread: float, dimensions: int) -> np.ndarray:
    return np.exp(-0.5 * (values / spread) ** 2) / spread**dimensions
