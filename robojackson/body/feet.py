"""Soles: where heels and toes are, and the pitch of a foot that stands flat.

BlazePose draws feet that point at the camera too steep, by 20 degrees and more; a foot that carries
and is still is level, and its pitch there is the detector's bias for the clip. World frame, metres,
radians. Order of the points: `motion.smpl_sequence.CONTACT_POINTS`.
"""

import numpy as np
from jaxtyping import Float
from scipy.ndimage import distance_transform_edt

from robojackson.body.forward_kinematics import Pose, apply, rotate_about, unit
from robojackson.body.skeleton import HEEL_OFFSET, SOLE_BELOW_TOE, keypoint, pair, rest_offset

_ALONG = rest_offset("left_foot") + rest_offset("left_big_toe")
REST_FOOT = float(np.linalg.norm(_ALONG))
REST_SLOPE = float(np.arctan2(-_ALONG[1], np.hypot(_ALONG[0], _ALONG[2])))
"""Downward slope from ankle to toe over a flat sole of our own skeleton."""
LARGEST_BIAS = np.radians(45.0)
STILL_MPS = 0.3
CARRIES_M = 0.08
FLAT = np.radians(25.0)
"""A planted foot steeper than this stands on its toes or its heel."""
ABOVE = np.array([0.0, 0.0, 1.0])


def foot_points(pose: Pose, rest_joints: Float[np.ndarray, "29 3"]) -> Float[np.ndarray, "T 4 3"]:
    """Return soles under heels and toes, in the frame of the pose."""
    foot = rest_joints[keypoint("left_big_toe")] - rest_joints[keypoint("left_ankle")]
    scale = np.linalg.norm(foot) / REST_FOOT
    count = len(pose.points)
    heel_offset = np.broadcast_to(HEEL_OFFSET * scale, (count, 3))
    sole_offset = np.broadcast_to(np.array([0.0, -SOLE_BELOW_TOE * scale, 0.0]), (count, 3))
    columns = []
    for ankle, ball, toe in zip(pair("ankle"), pair("foot"), pair("big_toe"), strict=True):
        columns.append(pose.points[:, ankle] + apply(pose.rotations[:, ankle], heel_offset))
        columns.append(pose.points[:, toe] + apply(pose.rotations[:, ball], sole_offset))
    return np.stack(columns, 1)


def pitch(feet: Float[np.ndarray, "T 4 3"]) -> Float[np.ndarray, "T 2"]:
    """Return the angle of each sole above the horizontal: positive when the toe is higher than the
    heel."""
    sole = feet[:, 1::2] - feet[:, 0::2]
    result: np.ndarray = np.arctan2(sole[..., 2], np.linalg.norm(sole[..., :2], axis=-1))
    return result


def pitch_bias(feet: Float[np.ndarray, "T 4 3"], fps: float) -> float:
    """Return the detector's pitch of a foot that stands, median over both feet's still, carrying
    frames.

    Zero where there are fewer than three such frames.
    """
    if len(feet) < 2:
        return 0.0
    toe = feet[:, 1::2]
    speed = np.linalg.norm(np.gradient(toe[..., 1:], axis=0), axis=-1) * fps
    low = feet.reshape(-1, 2, 2, 3)[..., 2].min(2)
    carrying = (speed < STILL_MPS) & (low - low.min(1, keepdims=True) < CARRIES_M)
    if carrying.sum() < 3:
        return 0.0
    return float(np.clip(np.median(pitch(feet)[carrying]), -LARGEST_BIAS, LARGEST_BIAS))


def stands_flat(feet: Float[np.ndarray, "T 4 3"], planted: np.ndarray) -> np.ndarray:
    """Return frames in which each foot stands on its whole sole, shape (T, 2).

    Heel and toe both stand, or one of them does and the foot is about level.
    """
    ends = planted.reshape(-1, 2, 2)
    result: np.ndarray = ends.all(2) | (ends.any(2) & (np.abs(pitch(feet)) < FLAT))
    return result


def level_feet(
    body_points: Float[np.ndarray, "T 29 3"],
    rest_joints: Float[np.ndarray, "29 3"],
    feet: Float[np.ndarray, "T 4 3"],
    flat: np.ndarray,
    ramp: float,
) -> tuple[Float[np.ndarray, "T 29 3"], Float[np.ndarray, "T 2"]]:
    """Return the keypoints whose standing feet are level and keep their heading, and the share of
    it.

    A standing foot takes the mean heading of its stretch; over `ramp` frames before and after, the
    foot goes over to what was measured.
    """
    held = np.array(body_points)
    share = np.stack([near(flat[:, side], ramp) for side in range(2)], 1)
    chains = zip(pair("ankle"), pair("foot"), pair("big_toe"), strict=True)
    for side, (ankle, *ends) in enumerate(chains):
        if not flat[:, side].any():
            continue
        forward = _steady_heading(feet[:, 2 * side + 1] - feet[:, 2 * side], flat[:, side])
        left = np.cross(ABOVE, forward)
        level = np.stack([left, np.broadcast_to(ABOVE, left.shape), forward], -1)
        for end in ends:
            measured = body_points[:, end] - body_points[:, ankle]
            target = apply(
                level, np.broadcast_to(rest_joints[end] - rest_joints[ankle], left.shape)
            )
            mixed = measured + share[:, side, None] * (target - measured)
            length = np.linalg.norm(target, axis=-1, keepdims=True)
            held[:, end] = held[:, ankle] + unit(mixed) * length
    return held, share


def near(flags: np.ndarray, ramp: float) -> Float[np.ndarray, " T"]:
    """Return 1 where True, falling smoothly to 0 over `ramp` frames on both sides."""
    if not flags.any():
        return np.zeros(len(flags))
    distance = distance_transform_edt(~flags)
    part = np.clip(1.0 - distance / ramp, 0.0, 1.0)
    result: np.ndarray = part * part * (3.0 - 2.0 * part)
    return result


def _steady_heading(sole: np.ndarray, flat: np.ndarray) -> Float[np.ndarray, "T 3"]:
    """Return the horizontal direction of a foot: the mean of each standing stretch, else
    interpolated."""
    level = sole * [1.0, 1.0, 0.0]
    known = np.array(level)
    for start, end in stretches(flat):
        known[start:end] = level[start:end].mean(0)
    time = np.arange(len(sole))
    filled = [np.interp(time, time[flat], column[flat]) for column in known.T]
    return unit(np.stack(filled, -1))


def stretches(flags: np.ndarray) -> list[tuple[int, int]]:
    """Return the runs of True as (first, one past the last)."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], flags.astype(int), [0]])))
    return [(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def turn_feet(
    points: Float[np.ndarray, "T 29 3"], angles: Float[np.ndarray, "T 2"]
) -> Float[np.ndarray, "T 29 3"]:
    """Return the keypoints with the balls and toes of the feet lowered about the ankle by an
    angle."""
    turned = np.array(points)
    feet = zip(pair("ankle"), pair("foot"), pair("big_toe"), strict=True)
    for side, (ankle, *ends) in enumerate(feet):
        axis = unit(np.cross(ABOVE, points[:, ends[-1]] - points[:, ankle]))
        turned[:, ends] = lowered(points, ankle, ends, axis, angles[:, side])
    return turned


def lowered(
    points: Float[np.ndarray, "T 29 3"],
    ankle: int,
    ends: list[int],
    axis: Float[np.ndarray, "T 3"],
    angle: Float[np.ndarray, " T"],
) -> Float[np.ndarray, "T E 3"]:
    """Return keypoints of a foot, turned about its ankle around an axis by an angle."""
    turn = rotate_about(axis, np.cos(angle), np.sin(angle))
    centre = points[:, [ankle]]
    return np.asarray(centre + apply(turn[:, None], points[:, ends] - centre))
