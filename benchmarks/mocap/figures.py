"""The figures of the mocap benchmark: joints, ground, feet and path of one motion against a truth.

Metres and seconds inside, the units of the names outside. The truth's contacts come from its own
feet over the floor that is refitted under them, as for ours: the source of dance_b floats.
"""

from itertools import pairwise

import numpy as np
from jaxtyping import Float, Int

from benchmarks.mocap.truth import HIPS, JOINTS, Truth
from robojackson.body.feet import foot_points
from robojackson.body.forward_kinematics import kabsch, unit
from robojackson.body.skeleton import keypoint
from robojackson.metrics import dance_score, motion_quality, pose_error, world_error
from robojackson.mocap.grounding import floor as ground
from robojackson.mocap.pose.posed_body import pose_sequence
from robojackson.motion.smpl_sequence import AIR, PLANTED, SLIDING, SmplSequence

Figures = dict[str, float]
SEAM_MASK = 3
"""Frames before and after a loop's seam that no figure of joints counts."""
DOWN_M, UP_M = 0.045, 0.075
STILL_MPS, MOVING_MPS = 0.20, 0.35
SHORTEST_S = 0.1
BENT_DEG, FEWEST_BENT = 30.0, 10
"""Flexion above which a knee is bent; fewest states of bent knees that are measured."""
FLOOR_HZ = 3.0
FLOATS_M = 0.03
"""Of the truth's contacts: hysteresis of height over its floor and of speed along the floor."""


def counted(truth: Truth, count: int) -> np.ndarray:
    """Return frames that count, shape (count,): all but those around the seams of a loop."""
    frames = np.arange(count)
    keep = np.ones(count, bool)
    for seam in truth.seams:
        keep &= (frames < seam - SEAM_MASK) | (frames >= seam + SEAM_MASK)
    return keep


def joint_errors(joints: Float[np.ndarray, "T 12 3"], truth: Truth, fps: float) -> Figures:
    """Return PA-MPJPE and RR-MPJPE in mm, MPJVE in mm/s, ratios of mean joint speed and
    acceleration, and the gain along the true velocities (sum v v* / sum v*^2)."""
    count = min(len(joints), len(truth.joints))
    keep = counted(truth, count)
    mine, right = joints[:count], truth.joints[:count]
    aligned, goal = _one_rotation(mine, right, keep), pose_error.root_relative(right, HIPS)
    velocity, acceleration = (_differences(aligned, goal, keep, fps, order) for order in (1, 2))
    return {
        "pa_mpjpe_mm": 1e3 * pose_error.pa_mpjpe(mine[keep], right[keep]),
        "rr_mpjpe_mm": 1e3 * pose_error.mpjpe(aligned[keep], goal[keep]),
        "mpjve_mm_s": 1e3 * pose_error.mpjpe(*velocity),
        "speed_ratio": _size(velocity[0]) / _size(velocity[1]),
        "velocity_gain": _gain(*velocity),
        "acceleration_ratio": _size(acceleration[0]) / _size(acceleration[1]),
    }


def velocity_score(joints: Float[np.ndarray, "T 12 3"], truth: Truth) -> Figures:
    """Return the score of the velocities, path included, after one rigid motion a clip."""
    count = min(len(joints), len(truth.joints))
    keep = counted(truth, count)
    goal = truth.joints[:count]
    aligned = world_error.align_world(joints[:count], goal, scaled=False)
    return {"velocity_score": dance_score.moving_score(*_differences(aligned, goal, keep, 1.0, 1))}


def knee_figures(joints: Float[np.ndarray, "T 12 3"], truth: Truth) -> Figures:
    """Return how far truly bent knees are off, degrees (less than 0: too straight), and the slope
    of their flexion on the true one; nothing where no knee bends."""
    count = min(len(joints), len(truth.joints))
    keep = counted(truth, count)
    ours, goal = (flexion_deg(points[:count])[keep] for points in (joints, truth.joints))
    bent = goal > BENT_DEG
    if bent.sum() < FEWEST_BENT:
        return {}
    gain = np.polyfit(goal.ravel(), ours.ravel(), 1)[0]
    return {"knee_bias_deg": float((ours - goal)[bent].mean()), "knee_gain": float(gain)}


def flexion_deg(joints: Float[np.ndarray, "T 12 3"]) -> Float[np.ndarray, "T 2"]:
    """Return the flexion of the left and the right knee, degrees; 0 is straight."""
    hip, knee, ankle = (joints[:, list(pair)] for pair in ((0, 1), (2, 3), (4, 5)))
    thigh, shank = unit(knee - hip), unit(ankle - knee)
    return np.asarray(np.degrees(np.arccos(np.clip(np.sum(thigh * shank, -1), -1.0, 1.0))))


def path_error_share(sequence: SmplSequence, truth: Truth) -> Figures:
    """Return the mean error of the root's path over its length, after one turn about z, shift and
    scale."""
    count = min(len(sequence), len(truth.joints))
    keep = counted(truth, count)
    hips = [keypoint(JOINTS[index]) for index in HIPS]
    mine = sequence.joints[:count, hips].mean(1)[keep]
    goal = truth.joints[:count, list(HIPS)].mean(1)[keep]
    steps = np.linalg.norm(np.diff(goal, axis=0), axis=-1)
    length = float(steps[np.diff(np.flatnonzero(keep)) == 1].sum())
    x, y = mine - mine.mean(0), goal - goal.mean(0)
    across, target = x[:, 0] + 1j * x[:, 1], y[:, 0] + 1j * y[:, 1]
    across = across * np.exp(1j * np.angle((across.conj() * target).sum()))
    turned = np.stack([across.real, across.imag, x[:, 2]], -1)
    scale = (turned * y).sum() / (turned**2).sum()
    error = np.linalg.norm(scale * turned - y, axis=-1).mean()
    return {"path_error": float(error / length), "path_m": length, "path_scale": float(scale)}


def floor_figures(sequence: SmplSequence) -> Figures:
    """Return how the motion treats the floor by its own contacts."""
    feet = foot_points(pose_sequence(sequence), sequence.rest_joints)
    planted = sequence.contact == PLANTED
    return {
        "planted_share": float(planted.mean()),
        "unsupported_share": unsupported_share(sequence),
        "floating_share": float((feet[..., 2].min(1) > FLOATS_M)[~falls(sequence)].mean()),
        "planted_slide_cm_s": 100.0 * motion_quality.foot_slide(feet, planted, sequence.fps),
        "penetration_mm": 1e3 * motion_quality.floor_penetration(feet),
        "jerk_m_s3": motion_quality.jerk(sequence.joints, sequence.fps),
    }


def unsupported_share(sequence: SmplSequence) -> float:
    """Return the share of all frames in which nothing touches and the body does not fall (a_z >
    -g/2)."""
    return float(((sequence.contact == AIR).all(1) & ~falls(sequence)).mean())


def falls(sequence: SmplSequence) -> np.ndarray:
    """Return frames in which the centre of mass accelerates downward by more than g / 2."""
    centre = ground.centre_of_mass(sequence.keypoints_w)[:, 2]
    acceleration = np.gradient(np.gradient(centre)) * sequence.fps**2
    return np.asarray(acceleration < -ground.GRAVITY / 2.0)


def contact_figures(sequence: SmplSequence, truth: Truth) -> Figures:
    """Return F1 of the states of the foot points, and their slide where the truth is planted."""
    if truth.feet is None:
        return {}
    count = min(len(sequence), len(truth.feet))
    goal = true_contacts(truth.feet[:count], sequence.fps)
    ours = sequence.contact[:count]
    feet = foot_points(pose_sequence(sequence), sequence.rest_joints)[:count]
    stands, keep = goal == PLANTED, counted(truth, count)
    return {
        "planted_f1": f1(ours[keep] == PLANTED, stands[keep]),
        "touching_f1": f1(ours[keep] != AIR, goal[keep] != AIR),
        "true_planted_share": float(stands.mean()),
        "slide_cm_s": 100.0 * motion_quality.foot_slide(feet, stands, sequence.fps),
        "true_slide_cm_s": 100.0
        * motion_quality.foot_slide(truth.feet[:count], stands, sequence.fps),
    }


def true_contacts(feet: Float[np.ndarray, "T 4 3"], fps: float) -> Int[np.ndarray, "T 4"]:
    """Return the states of the true foot points: low over their refitted floor, still along it."""
    flying = np.zeros(len(feet), bool)
    floor = ground.floor_height(feet[..., 2].min(1), flying, fps, FLOOR_HZ)
    height = feet[..., 2] - floor[:, None]
    speed = np.linalg.norm(np.gradient(feet[..., :2], axis=0), axis=-1) * fps
    shortest = max(1, round(SHORTEST_S * fps))
    low = join_short(hysteresis(height, DOWN_M, UP_M), shortest)
    still = join_short(hysteresis(speed, STILL_MPS, MOVING_MPS), shortest)
    low |= height == height.min(1, keepdims=True)
    return np.where(~low, AIR, np.where(still, PLANTED, SLIDING)).astype(np.int8)


def hysteresis(values: np.ndarray, on: float, off: float) -> np.ndarray:
    """Return True from a value below `on` until one above `off`; undecided beginnings count as
    below."""
    decided = np.where(values < on, 1, np.where(values > off, 0, -1))
    decided[0] = np.where(decided[0] < 0, 1, decided[0])
    frames = np.arange(len(values)).reshape(-1, *([1] * (values.ndim - 1)))
    last = np.maximum.accumulate(np.where(decided >= 0, frames, 0), axis=0)
    return np.take_along_axis(decided, last, axis=0).astype(bool)


def join_short(states: np.ndarray, shortest: int) -> np.ndarray:
    """Give runs of fewer than `shortest` frames along axis 0 the state before them."""
    joined = states.copy()
    for column in joined.reshape(len(joined), -1).T:
        edges = np.flatnonzero(np.diff(column)) + 1
        for start, end in pairwise(edges):
            if end - start < shortest:
                column[start:end] = column[start - 1]
    return joined


def f1(found: np.ndarray, true: np.ndarray) -> float:
    """Return the harmonic mean of precision and recall; 1 where there is nothing to find and
    nothing found."""
    total = found.sum() + true.sum()
    return float(2.0 * (found & true).sum() / total) if total else 1.0


def tilt_error_deg(sequence: SmplSequence, truth: Truth) -> float:
    """Return the angle between the estimated and the true vertical, degrees."""
    up = np.array(sequence.camera["rotation_w"])[2]
    return float(np.degrees(np.arccos(np.clip(up @ truth.up_c, -1.0, 1.0))))


def _one_rotation(mine: np.ndarray, right: np.ndarray, keep: np.ndarray) -> np.ndarray:
    """Return the root-relative joints after the rotation that fits them best over the frames that
    count."""
    x, y = pose_error.root_relative(mine, HIPS), pose_error.root_relative(right, HIPS)
    return np.asarray(x @ kabsch(x[keep].reshape(-1, 3), y[keep].reshape(-1, 3)).T)


def _differences(
    mine: np.ndarray, goal: np.ndarray, keep: np.ndarray, fps: float, order: int
) -> tuple[np.ndarray, np.ndarray]:
    """Return the differences in time of both whose frames all count, times fps^order."""
    whole = np.lib.stride_tricks.sliding_window_view(keep, order + 1).all(1)
    ours, right = (np.diff(points, order, axis=0)[whole] for points in (mine, goal))
    return ours * fps**order, right * fps**order


def _gain(mine: np.ndarray, right: np.ndarray) -> float:
    """Return the share of the true vectors that ours have along them."""
    return float(np.sum(mine * right) / np.sum(right**2))


def _size(vectors: np.ndarray) -> float:
    return float(np.linalg.norm(vectors, axis=-1).mean())
