"""DeepMimic motion files: reading, writing, resampling, looping, and world rotations.

A file is JSON with `Frames`, 44 numbers each: duration, root position, root quaternion, then in
fixed order quaternions of ball joints and angles of hinges, each relative to its parent
(Peng et al., DeepMimic, 2018). Frame of the file: x forward, y up, z right; metres, radians,
quaternions wxyz.
"""

import gzip
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation, Slerp

FRAME_NUMBERS = 44
THIGH_LENGTH = 0.421546
SHIN_LENGTH = 0.40987
"""Metres, of the humanoid that the files were captured on."""

BALL_JOINTS: Mapping[str, tuple[str, int]] = {
    "chest": ("root", 8),
    "neck": ("chest", 12),
    "right_hip": ("root", 16),
    "right_ankle": ("right_knee", 21),
    "right_shoulder": ("chest", 25),
    "left_hip": ("root", 30),
    "left_ankle": ("left_knee", 35),
    "left_shoulder": ("chest", 39),
}
"""Parent, and where the quaternion stands in a frame."""
HINGES: Mapping[str, tuple[str, int]] = {
    "right_knee": ("right_hip", 20),
    "right_elbow": ("right_shoulder", 29),
    "left_knee": ("left_hip", 34),
    "left_elbow": ("left_shoulder", 43),
}
"""Parent, and where the angle about z stands in a frame."""
TREE_ORDER = (
    "chest", "neck", "right_hip", "right_knee", "right_ankle", "right_shoulder", "right_elbow",
    "left_hip", "left_knee", "left_ankle", "left_shoulder", "left_elbow",
)  # fmt: skip
"""Parents before children."""


@dataclass(frozen=True)
class Motion:
    """One clip of the file format.

    Attributes:
        fps: Frames a second; files round the duration of a frame, so theirs is a whole number.
        root_position: Metres, y up.
        rotations: World rotation of the root and of the twelve joints, T each.
    """

    fps: float
    root_position: Float[np.ndarray, "T 3"]
    rotations: Mapping[str, Rotation]

    def __len__(self) -> int:
        return len(self.root_position)


def read(path: Path, fps: float, loops: int = 1) -> Motion:
    """Return a clip resampled to `fps`; every further loop continues where the last one ended."""
    text = gzip.decompress(path.read_bytes()) if path.suffix == ".gz" else path.read_bytes()
    frames = np.array(json.loads(text)["Frames"], dtype=float)
    if frames.ndim != 2 or frames.shape[1] != FRAME_NUMBERS:
        raise ValueError(f"{path}: {frames.shape} numbers, expected (T, {FRAME_NUMBERS})")
    return repeated(resampled(_from_frames(frames), fps), loops)


def write(path: Path, motion: Motion) -> None:
    """Write a motion as a file that DeepMimic's own tools and `read` understand."""
    frames = np.zeros((len(motion), FRAME_NUMBERS))
    frames[:, 0] = 1.0 / motion.fps
    frames[:, 1:4] = motion.root_position
    frames[:, 4:8] = _wxyz(motion.rotations["root"])
    for name, (parent, column) in BALL_JOINTS.items():
        local = motion.rotations[parent].inv() * motion.rotations[name]
        frames[:, column : column + 4] = _wxyz(local)
    for name, (parent, column) in HINGES.items():
        local = motion.rotations[parent].inv() * motion.rotations[name]
        frames[:, column] = local.as_rotvec()[:, 2]
    rows = ",\n".join(json.dumps([round(float(x), 8) for x in row]) for row in frames)
    path.write_text('{"Loop": "wrap", "Frames": [\n' + rows + "\n]}\n")


def resampled(motion: Motion, fps: float) -> Motion:
    """Return the same motion at another rate; the first frame stays, rotations go along
    geodesics."""
    source = np.arange(len(motion)) / motion.fps
    times = np.arange(0.0, source[-1] + 1e-6, 1.0 / fps).clip(max=source[-1])
    position = np.stack([np.interp(times, source, p) for p in motion.root_position.T], -1)
    rotations = {name: Slerp(source, r)(times) for name, r in motion.rotations.items()}
    return Motion(fps, position, rotations)


def repeated(motion: Motion, loops: int) -> Motion:
    """Return `loops` cycles, each moved on the floor by the distance that a cycle covers."""
    cycle = (motion.root_position[-1] - motion.root_position[0]) * np.array([1.0, 0.0, 1.0])
    position = np.concatenate([motion.root_position + k * cycle for k in range(loops)])
    rotations = {n: Rotation.concatenate([r] * loops) for n, r in motion.rotations.items()}
    return Motion(motion.fps, position, rotations)


def _from_frames(frames: Float[np.ndarray, "T 44"]) -> Motion:
    rotations = {"root": _quaternions(frames[:, 4:8])}
    for name in TREE_ORDER:
        if name in BALL_JOINTS:
            parent, column = BALL_JOINTS[name]
            local = _quaternions(frames[:, column : column + 4])
        else:
            parent, column = HINGES[name]
            local = Rotation.from_rotvec(frames[:, column, None] * np.array([0.0, 0.0, 1.0]))
        rotations[name] = rotations[parent] * local
    return Motion(float(round(1.0 / frames[0, 0])), frames[:, 1:4], rotations)


def _quaternions(wxyz: Float[np.ndarray, "T 4"]) -> Rotation:
    return Rotation.from_quat(wxyz[:, [1, 2, 3, 0]])


def _wxyz(rotation: Rotation) -> Float[np.ndarray, "T 4"]:
    result: np.ndarray = rotation.as_quat()[:, [3, 0, 1, 2]]
    return result
