"""Whole-clip refinement of the twelve body landmarks: the most probable smooth motion of a
skeleton.

Minimises over all frames at once, robustly: the distance from the image landmarks, from the
detector's depth relative to the hips, from the person's bone lengths, and from zero acceleration.
Gauss-Newton with reweighting; frames are coupled only through the acceleration, so the normal
matrix is banded and a clip takes a fraction of a second. Camera frame, metres.
"""

from dataclasses import dataclass as plain_dataclass

import numpy as np
from jaxtyping import Float
from scipy.linalg import solveh_banded

from robojackson.body.forward_kinematics import unit
from robojackson.body.skeleton import keypoint
from robojackson.config import config_dataclass
from robojackson.mocap.landmarks.banded_matrix import add_acceleration, to_bands
from robojackson.mocap.landmarks.blazepose import BODY, LANDMARK_NAMES, landmark
from robojackson.mocap.landmarks.leash import leashed

SHAPE = (len(BODY), 3)
SIZE = SHAPE[0] * SHAPE[1]
BONES = tuple(
    (f"{side}_{start}", f"{side}_{end}")
    for start, end in (
        ("hip", "knee"),
        ("knee", "ankle"),
        ("shoulder", "elbow"),
        ("elbow", "wrist"),
        ("shoulder", "hip"),
    )
    for side in ("left", "right")
) + (("left_hip", "right_hip"), ("left_shoulder", "right_shoulder"))
ORDER = [LANDMARK_NAMES[index] for index in BODY]
HIPS = [ORDER.index("left_hip"), ORDER.index("right_hip")]
LEAST_VISIBILITY = 0.1
SUDDEN = 1.5
"""Spreads of acceleration from which on it counts less than squared."""


@config_dataclass
class RefineConfig:
    """Standard deviations of the four terms.

    Attributes:
        enabled: Whether to refine at all.
        image_m: Spread of a landmark across the image, at the person's distance, metres.
        depth_m: Spread of the detector's depth relative to the hips, metres.
        bone_m: Spread of a bone's length in one frame, metres.
        acceleration_mps2: Spread of a joint's acceleration, m/s^2.
        leash_m: A landmark moves no further than this from where it was, seen from the hips: what
            needs more is a frame in which the terms contradict each other; metres.
        rounds: Gauss-Newton steps.
    """

    enabled: bool = True
    image_m: float = 0.02
    depth_m: float = 0.07
    bone_m: float = 0.03
    acceleration_mps2: float = 20.0
    leash_m: float = 0.12
    rounds: int = 12


@plain_dataclass(frozen=True)
class Evidence:
    """Measurements of a clip for the twelve landmarks.

    Attributes:
        rays: Image points at depth one.
        depth: The detector's depth relative to the middle of the hips, metres.
        trust: Weight of a landmark, 0..1, from its visibility.
        lengths: Lengths of `BONES`, metres.
        fps: Frames a second.
        depth_m: Standard deviation of `depth`, metres.
    """

    rays: Float[np.ndarray, "T 12 2"]
    depth: Float[np.ndarray, "T 12"]
    trust: Float[np.ndarray, "T 12"]
    lengths: Float[np.ndarray, " B"]
    fps: float
    depth_m: Float[np.ndarray, "T 12"]


def refine(
    placed: Float[np.ndarray, "T 33 3"],
    visibility: Float[np.ndarray, "T 33"],
    rest_joints: Float[np.ndarray, "29 3"],
    fps: float,
    config: RefineConfig,
    depth_m: Float[np.ndarray, "T 12"] | None = None,
) -> Float[np.ndarray, "T 33 3"]:
    """Return landmarks with the body refined; face, hands and feet follow their carriers.

    `depth_m` is the spread of each depth; without it the configuration's one figure applies.
    """
    body = placed[:, BODY]
    evidence = gather(placed, visibility, rest_joints, fps, config, depth_m)
    for _ in range(config.rounds):
        body = body + _step(body, evidence, config)
    return carry_along(placed, leashed(placed[:, BODY], body, fps, config.leash_m))


def gather(
    placed: Float[np.ndarray, "T 33 3"],
    visibility: Float[np.ndarray, "T 33"],
    rest_joints: Float[np.ndarray, "29 3"],
    fps: float,
    config: RefineConfig,
    depth_m: Float[np.ndarray, "T 12"] | None = None,
) -> Evidence:
    """Return the measurements of the body in landmarks before the camera."""
    body = placed[:, BODY]
    return Evidence(
        rays=body[..., :2] / body[..., 2:],
        depth=body[..., 2] - body[:, HIPS, 2].mean(1, keepdims=True),
        trust=np.clip(visibility[:, BODY], LEAST_VISIBILITY, 1.0),
        lengths=bone_lengths(rest_joints),
        fps=fps,
        depth_m=np.full(body.shape[:2], config.depth_m) if depth_m is None else depth_m,
    )


def bone_lengths(rest_joints: Float[np.ndarray, "29 3"]) -> Float[np.ndarray, " B"]:
    """Return lengths of `BONES` in a rest pose, metres."""
    ends = np.array([[keypoint(a), keypoint(b)] for a, b in BONES])
    result: np.ndarray = np.linalg.norm(rest_joints[ends[:, 1]] - rest_joints[ends[:, 0]], axis=-1)
    return result


def carry_along(
    placed: Float[np.ndarray, "T 33 3"], body: Float[np.ndarray, "T 12 3"]
) -> Float[np.ndarray, "T 33 3"]:
    """Return all landmarks, the others moved with their body landmark."""
    moved = np.array(placed)
    change = body - placed[:, BODY]
    shoulders = [ORDER.index("left_shoulder"), ORDER.index("right_shoulder")]
    head = change[:, shoulders].mean(1)
    for index, name in enumerate(LANDMARK_NAMES):
        side, _, part = name.partition("_")
        if index < landmark("left_shoulder"):
            moved[:, index] += head
        elif part in ("pinky", "index", "thumb"):
            moved[:, index] += change[:, ORDER.index(f"{side}_wrist")]
        elif part in ("heel", "foot_index"):
            moved[:, index] += change[:, ORDER.index(f"{side}_ankle")]
    moved[:, BODY] = body
    return moved


def _step(
    body: Float[np.ndarray, "T 12 3"], evidence: Evidence, config: RefineConfig
) -> Float[np.ndarray, "T 12 3"]:
    """Run one Gauss-Newton step."""
    count = len(body)
    jacobian, residual = residuals(body, evidence, config)
    normal = np.einsum("tri,trj->tij", jacobian, jacobian)
    moment = np.einsum("tri,tr->ti", jacobian, residual)
    bands = to_bands(normal)
    stiff = stiffness(body, evidence.fps, config)
    second = np.diff(body.reshape(count, SIZE), 2, axis=0) * stiff
    for offset, factor in enumerate((1.0, -2.0, 1.0)):
        moment[offset : count - 2 + offset] += factor * second
    if count > 2:
        add_acceleration(bands, stiff)
    step = solveh_banded(bands, -moment.reshape(-1))
    result: np.ndarray = step.reshape(count, *SHAPE)
    return result


def stiffness(
    body: Float[np.ndarray, "T 12 3"], fps: float, config: RefineConfig
) -> Float[np.ndarray, "T-2 36"]:
    """Return the weight of the squared second difference of each coordinate, 1/m^2, pseudo-Huber.

    A frame has the same weight at any frame rate, so that a clip of few frames is not smoothed
    more: errors of detectors are correlated in neighbouring frames. True accelerations, such as a
    kick, are kept.
    """
    acceleration = np.diff(body, 2, axis=0) * fps**2 / config.acceleration_mps2
    robust = (1.0 + (acceleration**2).sum(-1) / SUDDEN**2) ** -0.5
    return np.repeat(robust * (fps**2 / config.acceleration_mps2) ** 2, 3, axis=1)


def residuals(
    body: np.ndarray, evidence: Evidence, config: RefineConfig
) -> tuple[Float[np.ndarray, "T R 36"], Float[np.ndarray, "T R"]]:
    """Return robustly weighted residuals of image, depth and bones, and their derivatives."""
    parts = (
        _image(body, evidence, config.image_m),
        _depth(body, evidence),
        _bones(body, evidence, config.bone_m),
    )
    jacobian = np.concatenate([part[0] for part in parts], 1)
    residual = np.concatenate([part[1] for part in parts], 1)
    return jacobian.reshape(*residual.shape, SIZE), residual


def _image(body: np.ndarray, evidence: Evidence, spread: float) -> tuple[np.ndarray, np.ndarray]:
    """Return (x - u z) / spread across the image at the landmark's own depth, pseudo-Huber."""
    count, points = body.shape[:2]
    residual = (body[..., :2] - evidence.rays * body[..., 2:]) / spread
    robust = (1.0 + (residual**2).sum(-1)) ** -0.25 * np.sqrt(evidence.trust)
    jacobian = np.zeros((count, points, 2, points, 3))
    each = np.arange(points)
    for axis in range(2):
        jacobian[:, each, axis, each, axis] = robust / spread
        jacobian[:, each, axis, each, 2] = -evidence.rays[..., axis] * robust / spread
    return (
        jacobian.reshape(count, 2 * points, points, 3),
        (residual * robust[..., None]).reshape(count, -1),
    )


def _depth(body: np.ndarray, evidence: Evidence) -> tuple[np.ndarray, np.ndarray]:
    """Return depth relative to the middle of the hips against the detector's, pseudo-Huber."""
    count, points = body.shape[:2]
    spread = evidence.depth_m
    relative = body[..., 2] - body[:, HIPS, 2].mean(1, keepdims=True)
    residual = (relative - evidence.depth) / spread
    robust = (1.0 + residual**2) ** -0.25 * np.sqrt(evidence.trust)
    each = np.eye(points)
    each[:, HIPS] -= 0.5
    jacobian = np.zeros((count, points, points, 3))
    jacobian[..., 2] = each * (robust / spread)[..., None]
    return jacobian, residual * robust


def _bones(body: np.ndarray, evidence: Evidence, spread: float) -> tuple[np.ndarray, np.ndarray]:
    """Return bone lengths against the person's."""
    starts = np.array([ORDER.index(start) for start, _ in BONES])
    ends = np.array([ORDER.index(end) for _, end in BONES])
    bone = body[:, ends] - body[:, starts]
    along = unit(bone) / spread
    jacobian = np.zeros((len(body), len(BONES), *SHAPE))
    each = np.arange(len(BONES))
    jacobian[:, each, ends] = along
    jacobian[:, each, starts] = -along
    return jacobian, (np.linalg.norm(bone, axis=-1) - evidence.lengths) / spread
