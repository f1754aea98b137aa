"""Cycles: find where a clip repeats itself, close it, and put it on the robot's clock.

A clip is nearly cyclic when some later frame has the pose and the velocity of an early one, seen
from the hips and the heading. The cycle between them is closed by spreading what is left of the
seam (heading, pose, height, and for a dance on the spot the drift) evenly over the cycle. Metres,
seconds.
"""

import logging
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from jaxtyping import Float
from pydantic import Field
from scipy.ndimage import gaussian_filter1d

from robojackson.body.skeleton import KEYPOINT_NAMES
from robojackson.config import config_dataclass
from robojackson.errors import TrackTooShort
from robojackson.geometry.rotations import wrapped
from robojackson.motion.smpl_sequence import SmplSequence
from robojackson.retarget.targets.human_clip import HumanClip, at_steps, labels_at

_log = logging.getLogger(__name__)
_MIN_STEPS = 16
_LIMBS = ("hip", "knee", "ankle", "shoulder", "elbow", "wrist")
_COMPARED = [KEYPOINT_NAMES.index(f"{side}_{a}") for a in _LIMBS for side in ("left", "right")]
_HIPS, _SHOULDERS = _COMPARED[:2], _COMPARED[6:8]
_BONE_STARTS = (0, 1, 2, 3, 6, 7, 8, 9)  # hip, knee, shoulder, elbow: the next joint is two on
_GOOD_SEAM_M = 0.015  # seams below this are as good as each other: the longest cycle wins
_WHOLE_SEAM_M = 0.05  # a clip that was cut as a loop stays whole up to this seam
_SECONDS = 0.1  # velocity differences count over this time beside pose differences


@config_dataclass
class CycleConfig:
    """Conditions under which a clip counts as cyclic.

    Attributes:
        tolerance_m: Largest seam: mean keypoint distance plus a tenth of a second of the mean
            velocity difference, metres.
        limb_deg: Largest angle of a limb over the seam, degrees.
        heading_deg: Largest heading change of a cycle, whole turns left out, degrees.
        in_place_m_s: A cycle that travels slower than this is closed on the spot, m/s.
        least_share: Smallest share of the clip that a cycle must keep.
    """

    tolerance_m: float = Field(default=0.09, gt=0)
    limb_deg: float = Field(default=15.0, gt=0)
    heading_deg: float = Field(default=20.0, gt=0)
    in_place_m_s: float = Field(default=0.15, ge=0)
    least_share: float = Field(default=0.5, gt=0, le=1)


@dataclass(frozen=True)
class Cycle:
    """Frames [start, end) of a cycle; `end` may be one past the clip.

    Attributes:
        start, end: Frames.
        seam_m: Mean keypoint distance and a tenth of a second of the mean velocity difference.
        seam_deg: Largest angle between a limb at the start and at the end.
    """

    start: int
    end: int
    seam_m: float
    seam_deg: float


def human_clip(
    sequence: SmplSequence,
    dt: float,
    cyclic: Literal["auto", "yes", "no"],
    tempo: float,
    config: CycleConfig,
) -> tuple[HumanClip, Cycle | None]:
    """Return the clip at the solver's steps, closed to a cycle where it is (or is said to be)
    cyclic.

    Raises:
        TrackTooShort: Fewer steps than the solver needs.
    """
    if len(sequence) < 4 or len(sequence) / sequence.fps / tempo < _MIN_STEPS * dt:
        raise TrackTooShort(
            f"{len(sequence)} frames ({len(sequence) / sequence.fps:.2f} s) are too short to "
            f"retarget: at least {_MIN_STEPS * dt:.2f} s are needed"
        )
    cycle = None if cyclic == "no" else find_cycle(sequence, config)
    if cycle is None and cyclic == "yes":  # a body that turns with every cycle is turned back
        cycle = find_cycle(sequence, replace(config, heading_deg=180.0))
    if cycle is None or (cyclic == "auto" and not _nearly_cyclic(cycle, config)):
        return _open_clip(sequence, dt, tempo), None
    _log.info("cycle: frames %d to %d, seam %.3f m", cycle.start, cycle.end, cycle.seam_m)
    return _closed_clip(sequence, cycle, dt, tempo, config), cycle


def _nearly_cyclic(cycle: Cycle, config: CycleConfig) -> bool:
    return cycle.seam_m <= config.tolerance_m and cycle.seam_deg <= config.limb_deg


def find_cycle(sequence: SmplSequence, config: CycleConfig) -> Cycle | None:
    """Return the whole clip where it is a loop; else the cycle with the smallest seam, longer ones
    preferred when they are as good."""
    pose, speed, yaw = _features(sequence)
    frames = len(sequence)
    shortest = max(int(np.ceil(config.least_share * frames)), 4)
    seam, turn = _seams(pose, speed, yaw, 0, np.array([frames]))
    if seam[0] <= _WHOLE_SEAM_M and turn[0] <= np.radians(config.heading_deg):
        return Cycle(0, frames, float(seam[0]), _limb_angle(pose[0], pose[frames]))
    best: Cycle | None = None
    best_score = np.inf
    stride = max(1, frames // 120)
    for start in range(0, frames - shortest + 1, stride):
        ends = np.arange(start + shortest, frames + 1)
        seam, turn = _seams(pose, speed, yaw, start, ends)
        score = np.maximum(seam, _GOOD_SEAM_M) + 0.02 * (1 - (ends - start) / frames)
        score[turn > np.radians(config.heading_deg)] = np.inf
        index = int(score.argmin())
        if score[index] < best_score:
            best_score = float(score[index])
            angle = _limb_angle(pose[start], pose[ends[index]])
            best = Cycle(start, int(ends[index]), float(seam[index]), angle)
    return best


def _seams(
    pose: np.ndarray, speed: np.ndarray, yaw: np.ndarray, start: int, ends: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the seam, metres, and heading change, radians, of the cycles from one start."""
    seam = np.linalg.norm(pose[ends] - pose[start], axis=-1).mean(axis=1)
    seam += _SECONDS * np.linalg.norm(speed[ends] - speed[start], axis=-1).mean(axis=1)
    return seam, np.abs(wrapped(yaw[ends] - yaw[start]))


def _limb_angle(a: Float[np.ndarray, "L 3"], b: Float[np.ndarray, "L 3"]) -> float:
    """Return the largest angle between the limbs of two poses, degrees."""
    first = np.stack([a[i + 2] - a[i] for i in _BONE_STARTS])
    second = np.stack([b[i + 2] - b[i] for i in _BONE_STARTS])
    lengths = np.linalg.norm(first, axis=1) * np.linalg.norm(second, axis=1)
    cosine = np.sum(first * second, axis=1) / np.maximum(lengths, 1e-9)
    return float(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))).max())


def _features(sequence: SmplSequence) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the limbs seen from hips and heading, their velocities, the heading; one frame past
    the end."""
    points = _extended(sequence.keypoints_w)
    yaw = heading(points)
    limbs = _turned(points[:, _COMPARED] - _ground_point(points)[:, None], -yaw)
    speed = np.gradient(gaussian_filter1d(limbs, 1.0, axis=0), 1 / sequence.fps, axis=0)
    return limbs, speed, yaw


def _extended(points: Float[np.ndarray, "T 29 3"]) -> Float[np.ndarray, "T+1 29 3"]:
    return np.concatenate([points, 2 * points[-1:] - points[-2:-1]])


def heading(points: Float[np.ndarray, "T 29 3"]) -> Float[np.ndarray, " T"]:
    """Return the unwrapped angle of the body's forward axis about z, from hips and shoulders,
    radians."""
    across = points[:, _HIPS[0]] - points[:, _HIPS[1]]
    across = across + points[:, _SHOULDERS[0]] - points[:, _SHOULDERS[1]]
    return np.asarray(np.unwrap(np.arctan2(-across[:, 0], across[:, 1])))


def _ground_point(points: np.ndarray) -> Float[np.ndarray, "T 3"]:
    """Return the point of the floor under the hips."""
    return np.asarray((points[:, _HIPS[0]] + points[:, _HIPS[1]]) / 2 * [1.0, 1.0, 0.0])


def _turned(vectors: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """Return vectors (T, P, 3) turned about z by an angle a frame."""
    cosine, sine = np.cos(angle)[:, None], np.sin(angle)[:, None]
    x, y, z = np.moveaxis(vectors, -1, 0)
    return np.stack([cosine * x - sine * y, sine * x + cosine * y, z], axis=-1)


def _open_clip(sequence: SmplSequence, dt: float, tempo: float) -> HumanClip:
    """Return the whole clip; an odd number of steps, so that every second one is a coarser clip."""
    last = (len(sequence) - 1) / sequence.fps
    pairs = int(np.floor(last / tempo / (2 * dt) + 1e-9))
    time_s = np.arange(2 * pairs + 1) * dt * tempo
    return HumanClip(
        time_s=time_s,
        keypoints_w=at_steps(sequence.keypoints_w, sequence.fps, time_s),
        contact=labels_at(sequence.contact, sequence.fps, time_s),
        valid=labels_at(sequence.valid, sequence.fps, time_s),
        dt=dt,
        cycle_offset=None,
    )


def _closed_clip(
    sequence: SmplSequence, cycle: Cycle, dt: float, tempo: float, config: CycleConfig
) -> HumanClip:
    """Return a cycle with an even number of steps; the clock is stretched to fit (under one step a
    cycle)."""
    seconds = (cycle.end - cycle.start) / sequence.fps
    steps = max(2 * round(seconds / tempo / (2 * dt)), _MIN_STEPS)
    share = np.arange(steps + 1) / steps
    time_s = (cycle.start + share * (cycle.end - cycle.start)) / sequence.fps
    points = at_steps(_extended(sequence.keypoints_w), sequence.fps, time_s)
    closed, travel = close(points, config.in_place_m_s * seconds)
    return HumanClip(
        time_s=time_s[:-1],
        keypoints_w=closed[:-1],
        contact=labels_at(sequence.contact, sequence.fps, time_s[:-1]),
        valid=labels_at(sequence.valid, sequence.fps, time_s[:-1]),
        dt=dt,
        cycle_offset=travel,
    )


def close(
    points: Float[np.ndarray, "N 29 3"], in_place_m: float
) -> tuple[Float[np.ndarray, "N 29 3"], Float[np.ndarray, "3"]]:
    """Make the last pose the first one, moved along the floor; what is left over goes evenly. The
    path turns with the body, so that feet that stand still do so on an arc, too.

    Returns the closed points and the displacement of the cycle, zero when it is under `in_place_m`.
    """
    share = np.linspace(0.0, 1.0, len(points))
    yaw, ground = heading(points), _ground_point(points)
    turn = wrapped(yaw[-1] - yaw[0])
    limbs = _turned(points - ground[:, None], -turn * share)
    limbs -= (share - 0.5)[:, None, None] * (limbs[-1] - limbs[0])
    steps = _turned(np.diff(ground, axis=0)[:, None], -turn * (share[1:] + share[:-1]) / 2)[:, 0]
    ground = ground[0] + np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)])
    travel = ground[-1] - ground[0]
    if np.linalg.norm(travel) < in_place_m:
        ground = ground - share[:, None] * travel
        travel = np.zeros(3)
    return limbs + ground[:, None], travel
