"""Motions of other projects, brought to our world and onto the floor.

A file with a world frame keeps its motion: axes are changed once, and the floor moved to z = 0.
HybrIK's output has no world frame: its joints are in front of a camera whose focal length changes
with the box of every frame. It is placed in front of one camera of fixed focal length, the depth is
filtered, and then gravity, floor, contacts and pinned feet are as in our own mocap, with HybrIK's
own twists.
"""

from dataclasses import replace

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from robojackson.body.feet import foot_points
from robojackson.body.forward_kinematics import Pose, forward, split
from robojackson.body.skeleton import (
    AIM_CHILD,
    KEYPOINT_NAMES,
    PARENTS,
    REST_OFFSETS,
    assemble,
    keypoint,
)
from robojackson.body.smoothing import lowpass
from robojackson.formats.foreign_motion import (
    ForeignMotion,
    HybrikMotion,
    require_person,
    skeleton_under,
)
from robojackson.mocap.grounding import contacts, flight
from robojackson.mocap.grounding.support import support_of
from robojackson.mocap.landmarks import pinhole_camera
from robojackson.mocap.landmarks.blazepose import fill_gaps
from robojackson.mocap.pose.known_twist import TurnedBody, pose_keypoints
from robojackson.mocap.recover import MocapConfig, recover_points
from robojackson.motion.smpl_sequence import SmplSequence

FLOOR_M = 0.01
"""Height of a floor that is not moved, metres."""
CUTOFF_HZ = 6.0
"""Zero-phase low-pass of HybrIK's joints, which are found frame by frame, hertz."""


def ground_foreign_motion(motion: ForeignMotion, fps: float) -> SmplSequence:
    """Return a motion with a world frame in our world frame: axes changed once, floor at z = 0,
    contacts found.

    Raises:
        BadTable: its skeleton is not a person's.
    """
    require_person(motion.rest_joints, "the skeleton")
    local = np.array(motion.rotations)
    local[:, 0] = motion.to_world @ local[:, 0]
    pose = forward(local, motion.rest_joints[None], motion.pelvis @ motion.to_world.T)
    feet = foot_points(pose, motion.rest_joints)
    height, lowest, falling, _, elsewhere = support_of(pose.points, feet, fps)
    flying = flight.flight(lowest, height, falling, fps)
    floor = float(np.median(lowest[~flying] if (~flying).any() else lowest))
    notes = list(motion.notes)
    if abs(floor) > FLOOR_M:
        notes.append(f"floor found at {100 * floor:.1f} cm of the file's own zero: moved to zero")
        drop = np.array([0.0, 0.0, floor])
        pose, feet = replace(pose, points=pose.points - drop), feet - drop
    if float(np.mean(pose.points[:, keypoint("neck"), 2] - pose.points[:, 0, 2])) < 0.0:
        notes.append("the trunk points down: are the file's axes the usual ones? See --up")
    speed = np.linalg.norm(np.gradient(feet[..., :2], axis=0), axis=-1) * fps
    config = contacts.ContactConfig()
    states = contacts.contacts(feet[..., 2], speed, falling | elsewhere, fps, config)
    return _sequence(fps, local, pose, motion.rest_joints, states, tuple(notes), motion.betas)


def ground_hybrik_motion(
    motion: HybrikMotion, fps: float, config: MocapConfig, cutoff_hz: float = CUTOFF_HZ
) -> SmplSequence:
    """Return HybrIK's motion in the world, on the floor.

    Raises:
        BadTable: its joints are not a person's.
    """
    require_person(motion.points, "the joints")
    full, valid = _all_frames(motion)
    rest = _skeleton(motion)
    turns = _twists(full, rest)

    def posed(points: np.ndarray) -> TurnedBody:
        return pose_keypoints(points, turns, full.confidence, rest, config.method)

    points = before_camera(full, fps, config, cutoff_hz)
    sequence = recover_points(points, posed, valid, _camera(motion, config), fps, config)
    return replace(sequence, betas=motion.betas)


def before_camera(
    motion: HybrikMotion, fps: float, config: MocapConfig, cutoff_hz: float = CUTOFF_HZ
) -> Float[np.ndarray, "T 29 3"]:
    """Return the keypoints before a camera of one focal length, smoothed, metres, camera axes.

    The position fits the keypoints in the image; HybrIK's own position depends on the box's width.
    """
    rays = _camera(motion, config).rays(motion.pixels)
    root = pinhole_camera.fit_root(motion.points, rays)
    root[:, 2:] = lowpass(root[:, 2:], fps, config.depth_cutoff_hz)
    result: np.ndarray = (
        lowpass(motion.points, fps, cutoff_hz) + lowpass(root, fps, cutoff_hz)[:, None]
    )
    return result


def kinematics_error_mm(motion: HybrikMotion) -> float | None:
    """Return the mean distance of HybrIK's joints from those of its rotations in our kinematics.

    Our skeleton gets the offsets that fit best over the clip; None without rotations.
    """
    if motion.rotations is None:
        return None
    rest = skeleton_under(motion.rotations, motion.points)
    posed = forward(motion.rotations, rest[None], motion.points[:, 0]).points
    return float(1e3 * np.linalg.norm(posed - motion.points, axis=-1).mean())


def _camera(motion: HybrikMotion, config: MocapConfig) -> pinhole_camera.Pinhole:
    focal = config.focal_px or pinhole_camera.guess_focal(motion.width, motion.height)
    return pinhole_camera.Pinhole(focal, motion.width, motion.height)


def _skeleton(motion: HybrikMotion) -> Float[np.ndarray, "29 3"]:
    """Return HybrIK's own skeleton from its rotations, else ours with its bone lengths."""
    if motion.rotations is not None:
        return skeleton_under(motion.rotations, motion.points)
    lengths = np.zeros(len(PARENTS))
    for index, parent in enumerate(PARENTS[1:], start=1):
        bone = motion.points[:, index] - motion.points[:, parent]
        lengths[index] = np.median(np.linalg.norm(bone, axis=-1))
    for index, name in enumerate(KEYPOINT_NAMES):
        if name.startswith("left_"):
            other = keypoint(name.replace("left", "right"))
            lengths[[index, other]] = lengths[[index, other]].mean()
    usual = np.maximum(np.linalg.norm(REST_OFFSETS, axis=-1), 1e-9)
    return assemble(REST_OFFSETS * (lengths / usual)[:, None])


def _twists(motion: HybrikMotion, rest: np.ndarray) -> Float[np.ndarray, "T 23 2"]:
    """Return the twists about our rest bones: HybrIK's own, or those of its rotations."""
    if motion.rotations is None:
        return motion.twist
    bones = np.stack([rest[AIM_CHILD[j]] - rest[j] for j in range(1, 24)])
    return split(motion.rotations[:, 1:], np.broadcast_to(bones, (len(motion), 23, 3)))[1]


def _all_frames(motion: HybrikMotion) -> tuple[HybrikMotion, np.ndarray]:
    """Return all frames, missing ones interpolated, and which frames have a person."""
    frames = np.arange(motion.frame[-1] + 1)
    valid = np.isin(frames, motion.frame)
    if valid.all():
        return motion, valid

    def filled(values: np.ndarray) -> np.ndarray:
        spread = np.zeros((len(frames), *values.shape[1:]))
        spread[valid] = values
        return fill_gaps(spread, valid)

    rotations = motion.rotations
    if rotations is not None:
        left, _, right = np.linalg.svd(filled(rotations))
        rotations = left @ right
    return replace(
        motion,
        points=filled(motion.points),
        pixels=filled(motion.pixels),
        twist=filled(motion.twist),
        rotations=rotations,
        confidence=filled(motion.confidence),
        frame=frames,
    ), valid


def _sequence(
    fps: float,
    local: np.ndarray,
    pose: Pose,
    rest: np.ndarray,
    states: np.ndarray,
    notes: tuple[str, ...],
    betas: np.ndarray,
) -> SmplSequence:
    count = len(local)
    vectors = Rotation.from_matrix(local.reshape(-1, 3, 3)).as_rotvec().reshape(count, 24, 3)
    return SmplSequence(
        fps=fps,
        global_orient=vectors[:, 0],
        body_pose=vectors[:, 1:].reshape(-1, 69),
        transl=pose.points[:, 0] - rest[0],
        joints=pose.points[:, :24],
        keypoints_w=pose.points,
        confidence=np.ones((count, 29)),
        contact=states,
        valid=np.ones(count, bool),
        betas=betas,
        rest_joints=rest,
        notes=notes,
    )
