"""Human motions for the retargeting benchmark that owe nothing to our mocap stage.

Truth of the bundled rendered clips, motion-capture files of DeepMimic, and clips made longer by
running them back and forth. World frame: x forward, y left, z up, metres, floor at z = 0.
"""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.ndimage import gaussian_filter1d, median_filter

from benchmarks.mocap.truth import SEAMS, SOLE_BELOW_BONE, SOLE_BONES, SOLE_LENGTH, video_path
from robojackson.body.skeleton import KEYPOINT_NAMES
from robojackson.motion.smpl_sequence import AIR, PLANTED, SLIDING, SmplSequence
from tools.render import deepmimic

MOCAP = ("walk", "dance_a", "dance_b", "spin")
_BONES: Mapping[str, str] = {
    "hip": "upperleg01", "knee": "lowerleg01", "ankle": "foot", "foot": "toe1-1",
    "big_toe": "toe1-2", "shoulder": "upperarm01", "elbow": "lowerarm01", "wrist": "wrist",
    "hand": "wrist", "middle": "finger3-1", "collar": "clavicle",
}  # fmt: skip
_LOW_M, _SLOW_M_S = 0.04, 0.3
_TO_WORLD = np.array([[1.0, 0, 0], [0, 0, -1.0], [0, 1.0, 0]])
_CHEST, _NECK, _HEAD = 0.236151, 0.223894, 0.175
_UPPER_ARM, _FOREARM = 0.274788, 0.258947
_HIP = np.array([0.0, 0.0, 0.084887])
_SHOULDER = np.array([-0.02405, 0.2435, 0.18311])
_SOLES = np.array([[-0.0435, -0.05, 0.0], [0.1335, -0.05, 0.0]])
"""Of the humanoid that DeepMimic's files were made for, metres; right side at +z."""


def truth_motion(clip: str) -> SmplSequence:
    """Return the motion of the body that a bundled clip shows, from its bones; the first cycle
    alone."""
    path = video_path(clip)
    with np.load(path.with_name(f"{clip}_gt.npz")) as data:
        bones = data["bone_names"].tolist()
        cycle = data["all_bones"][: SEAMS.get(clip, (None,))[0]].astype(float)
        at = dict(zip(bones, np.moveaxis(cycle, 1, 0), strict=True))
        fps = float(data["fps"])
    points = {
        f"{side}_{name}": at[f"{bone}.{side[0].upper()}"]
        for side in ("left", "right")
        for name, bone in _BONES.items()
    }
    points |= {"neck": at["neck01"], "head": at["head"]}
    points["head_top"] = at["head"] + 0.8 * (at["head"] - at["neck01"])
    soles = np.stack([at[name] for name in SOLE_BONES], axis=1)
    length = np.linalg.norm(soles[0, 1] - soles[0, 0])
    soles[..., 2] -= SOLE_BELOW_BONE * length / SOLE_LENGTH
    return _sequence(points, soles, fps)


def mocap_motion(path: Path, fps: float = 60.0) -> SmplSequence:
    """Return a motion-capture file of DeepMimic on its own skeleton."""
    motion = deepmimic.read(path, fps)
    turn, points = motion.rotations, {"root": motion.root_position}
    points["chest"] = points["root"] + turn["root"].apply([0, _CHEST, 0])
    points["neck"] = points["chest"] + turn["chest"].apply([0, _NECK, 0])
    points["head"] = points["neck"] + turn["neck"].apply([0, 0.5 * _HEAD, 0])
    points["head_top"] = points["neck"] + turn["neck"].apply([0, 1.5 * _HEAD, 0])
    soles = []
    for side, sign in (("left", -1.0), ("right", 1.0)):
        mirror = np.array([1.0, 1.0, sign])
        hip = points["root"] + turn["root"].apply(mirror * _HIP)
        knee = hip + turn[f"{side}_hip"].apply([0, -deepmimic.THIGH_LENGTH, 0])
        ankle = knee + turn[f"{side}_knee"].apply([0, -deepmimic.SHIN_LENGTH, 0])
        shoulder = points["chest"] + turn["chest"].apply(mirror * _SHOULDER)
        elbow = shoulder + turn[f"{side}_shoulder"].apply([0, -_UPPER_ARM, 0])
        wrist = elbow + turn[f"{side}_elbow"].apply([0, -_FOREARM, 0])
        heel, toe = (ankle + turn[f"{side}_ankle"].apply(sole) for sole in _SOLES)
        soles += [heel, toe]
        own = {"hip": hip, "knee": knee, "ankle": ankle, "big_toe": toe, "foot": toe}
        own |= {"shoulder": shoulder, "elbow": elbow, "wrist": wrist}
        points |= {f"{side}_{name}": at for name, at in own.items()}
    world = {name: at @ _TO_WORLD.T for name, at in points.items()}
    return _sequence(world, np.stack(soles, axis=1) @ _TO_WORLD.T, fps)


def _sequence(
    points: Mapping[str, np.ndarray], soles: Float[np.ndarray, "T 4 3"], fps: float
) -> SmplSequence:
    """Return a sequence whose lowest soles are at the floor; points that are not known are the
    hips."""
    middle = (points["left_hip"] + points["right_hip"]) / 2
    keypoints = np.stack([points.get(name, middle) for name in KEYPOINT_NAMES], axis=1)
    low = np.quantile(soles[..., 2].min(axis=1), 0.02)
    keypoints[..., 2] -= low
    soles = soles - np.array([0.0, 0.0, low])
    state = _contacts(soles, _falling(middle[:, 2], soles, fps), fps)
    frames = len(keypoints)
    return SmplSequence(
        fps=fps,
        global_orient=np.zeros((frames, 3)),
        body_pose=np.zeros((frames, 69)),
        transl=keypoints[:, 0],
        joints=keypoints[:, :24],
        keypoints_w=keypoints,
        confidence=np.ones((frames, 29)),
        contact=state,
        valid=np.ones(frames, bool),
        betas=np.zeros(10),
        rest_joints=np.zeros((29, 3)),
    )


def _contacts(
    soles: Float[np.ndarray, "T 4 3"], falling: Bool[np.ndarray, " T"], fps: float
) -> Int[np.ndarray, "T 4"]:
    """Return contacts: low points touch, slow ones stand; a body that does not fall touches with
    its lowest."""
    height = soles[..., 2]
    speed = np.linalg.norm(np.gradient(soles, axis=0)[..., :2], axis=-1) * fps
    low = (height < _LOW_M) | (height < height.min(axis=1, keepdims=True) + 1e-3)
    window = (2 * round(0.04 * fps) + 1, 1)
    low = median_filter(low.astype(int), window) * ~falling[:, None] > 0
    slow = median_filter((speed < _SLOW_M_S).astype(int), window) > 0
    return np.where(low, np.where(slow, PLANTED, SLIDING), AIR).astype(int)


def _falling(
    hips: Float[np.ndarray, " T"], soles: Float[np.ndarray, "T 4 3"], fps: float
) -> Bool[np.ndarray, " T"]:
    smooth = gaussian_filter1d(hips, 0.03 * fps)
    down = np.gradient(np.gradient(smooth)) * fps**2 < -0.5 * 9.81
    return np.asarray(down & (soles[..., 2].min(axis=1) > 0.03))


def lengthened(sequence: SmplSequence, seconds: float, fps: float = 30.0) -> SmplSequence:
    """Return the motion back and forth at `fps` until it lasts that long."""
    step = round(sequence.fps / fps)
    once = np.arange(0, len(sequence), step)
    there_and_back = np.concatenate([once, once[-2:0:-1]])
    index = np.resize(there_and_back, round(seconds * fps))
    return replace(
        sequence,
        fps=sequence.fps / step,
        keypoints_w=sequence.keypoints_w[index],
        contact=sequence.contact[index],
        valid=sequence.valid[index],
        global_orient=sequence.global_orient[index],
        body_pose=sequence.body_pose[index],
        transl=sequence.transl[index],
        joints=sequence.joints[index],
        confidence=sequence.confidence[index],
    )
