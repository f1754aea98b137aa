"""A human motion of another project's file, in its own axes and place.

`mocap.imported_motion` moves it to the world and onto the floor. SMPL's bodies turn about the
pelvis of their template, so that in their files pelvis = transl + PELVIS; metres, radians.
"""

import warnings
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from itertools import islice
from typing import Any

import numpy as np
from jaxtyping import Float, Int
from scipy.spatial.transform import Rotation

from robojackson.body.forward_kinematics import forward
from robojackson.body.skeleton import PARENTS, REST_JOINTS, assemble, keypoint
from robojackson.errors import BadTable
from robojackson.geometry.frames import SMPL_TO_WORLD
from robojackson.motion.smpl_sequence import SmplSequence

PELVIS: Mapping[str, Float[np.ndarray, "3"]] = {
    "smpl": np.array([0.0, -0.22, 0.03]),
    "smplx": np.array([0.0, -0.35, 0.01]),
}
"""Pelvis of the neutral template, rounded, metres; SMPL+H has SMPL's."""
Y_UP_TO_WORLD, Z_UP_TO_WORLD = SMPL_TO_WORLD, np.eye(3)
BODY_JOINTS = 22
"""Joints that SMPL, SMPL+H and SMPL-X share: SMPL's two hands are fingers in the others."""
LARGEST = 1e8
"""Largest magnitude of any number in a file."""
NO_NUMBERS = "bmM"
"""Kinds of arrays that NumPy would turn into numbers: truth values, spans and dates."""
LEGS_M = (0.2, 3.0)
"""Range of a person's leg length (hip to ankle), metres."""
MAX_LISTED = 12
"""Number of a file's arrays that an error names."""
REST_KEY = "rest_joints"
"""Name of the skeleton in our own files; other projects do not read it."""


@dataclass(frozen=True)
class ForeignMotion:
    """A motion as a file has it.

    Attributes:
        fps: Frames a second; None where the file does not contain it.
        rotations: Rotations of the 24 joints relative to their parents, the root's to the file's
            axes.
        pelvis: Position of the pelvis, metres, file's axes.
        rest_joints: The skeleton that the rotations pose; our own where the file has none.
        to_world: Rotation from the file's axes to x forward, y left, z up.
        betas: SMPL's shape coefficients.
        notes: Warnings for the user.
    """

    fps: float | None
    rotations: Float[np.ndarray, "T 24 3 3"]
    pelvis: Float[np.ndarray, "T 3"]
    rest_joints: Float[np.ndarray, "29 3"] = field(default_factory=lambda: REST_JOINTS.copy())
    to_world: Float[np.ndarray, "3 3"] = field(default_factory=lambda: Z_UP_TO_WORLD.copy())
    betas: Float[np.ndarray, "10"] = field(default_factory=lambda: np.zeros(10))
    notes: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.pelvis)


@dataclass(frozen=True)
class HybrikMotion:
    """The content of a HybrIK file, one row a frame in which a person was found.

    Attributes:
        points: 29 keypoints relative to the pelvis, metres, camera axes.
        pixels: The same keypoints in the image, pixels.
        twist: cos and sin of joints 1..23.
        rotations: Rotations of the 24 joints relative to their parents; None in files of NIKI's
            demo.
        confidence: Confidence of each keypoint, 0..1.
        frame: Number of each row's frame, from 0.
        betas: SMPL's shape coefficients, the clip's mean.
        width, height: Size of the image, pixels.
    """

    points: Float[np.ndarray, "N 29 3"]
    pixels: Float[np.ndarray, "N 29 2"]
    twist: Float[np.ndarray, "N 23 2"]
    rotations: Float[np.ndarray, "N 24 3 3"] | None
    confidence: Float[np.ndarray, "N 29"]
    frame: Int[np.ndarray, " N"]
    betas: Float[np.ndarray, "10"]
    width: int
    height: int

    def __len__(self) -> int:
        return len(self.points)


def rows(content: Mapping[str, Any], name: str, width: int, where: str) -> np.ndarray:
    """Return one array of a file as frames of `width` numbers, float64.

    Raises:
        BadTable: it is missing, has another shape, holds NaN, or too few frames.
    """
    if name not in content:
        raise BadTable(f"{where}: {name!r} is missing. It has: {listed(content)}")
    found = numbers(content[name])
    if found.dtype.kind != "f" or not found.size:
        raise BadTable(f"{where}: {name!r} is not an array of numbers with one row a frame")
    table = found.reshape(len(found), -1)
    if len(table) < 2 or table.shape[1] != width:
        raise BadTable(f"{where}: {name!r} is {found.shape}; expected (frames >= 2, {width})")
    if not (np.abs(table) < LARGEST).all():
        raise BadTable(f"{where}: {name!r} holds numbers that are not finite, or over {LARGEST:g}")
    return table


def numbers(value: Any) -> np.ndarray:
    """Return numbers of any shape with at least one axis; an empty array for any other value."""
    try:
        if np.asarray(value).dtype.kind in NO_NUMBERS:
            return np.zeros(0)
        with np.errstate(all="ignore"), warnings.catch_warnings():
            warnings.simplefilter("error")  # of complex numbers, whose half would be lost
            return np.atleast_1d(np.asarray(value, float))
    except (TypeError, ValueError, OverflowError, Warning):
        return np.zeros(0)


def number(value: Any) -> float | None:
    """Return one finite number, such as a frame rate; None for any other value."""
    found = numbers(value).ravel()
    return float(found[0]) if found.size == 1 and np.isfinite(found[0]) else None


def listed(names: Collection[Any]) -> str:
    """Return some names of a file, for a message."""
    listing = ", ".join(str(name)[:40] for name in islice(names, MAX_LISTED))
    more = len(names) - MAX_LISTED
    return (listing or "nothing") + (f" and {more} more" if more > 0 else "")


def require_person(points: Float[np.ndarray, "*T 29 3"], what: str) -> None:
    """Check that legs are as long as a person's and all numbers finite and within reach.

    Raises:
        BadTable: they are not; such a body breaks the following stages.
    """
    hip, knee, ankle = (points[..., keypoint(f"left_{n}"), :] for n in ("hip", "knee", "ankle"))
    with np.errstate(all="ignore"):
        bones = np.linalg.norm(knee - hip, axis=-1) + np.linalg.norm(ankle - knee, axis=-1)
    legs = float(np.median(bones))
    if not LEGS_M[0] <= legs <= LEGS_M[1] or not (np.abs(points) < LARGEST).all():
        raise BadTable(f"{what}: not a person, its legs are {legs:.3g} m long")


def same_length(where: str, **tables: np.ndarray) -> None:
    """Check that all arrays have the same number of frames.

    Raises:
        BadTable: the numbers differ.
    """
    if len({len(table) for table in tables.values()}) > 1:
        listing = ", ".join(f"{name} {len(table)}" for name, table in tables.items())
        raise BadTable(f"{where}: arrays of different length ({listing})")


def matrices(vectors: Float[np.ndarray, "T N"]) -> Float[np.ndarray, "T 24 3 3"]:
    """Return rotation matrices of axis-angle rows; joints that a row lacks are not turned."""
    given = vectors.reshape(len(vectors), -1, 3)[:, :24]
    full = np.zeros((len(vectors), 24, 3))
    full[:, : given.shape[1]] = given
    result: np.ndarray = Rotation.from_rotvec(full.reshape(-1, 3)).as_matrix().reshape(-1, 24, 3, 3)
    return result


def body_vectors(sequence: SmplSequence) -> Float[np.ndarray, "T 72"]:
    """Return the axis-angle vectors of all 24 joints."""
    return np.concatenate([sequence.global_orient, sequence.body_pose], axis=1)


def turned_root(
    sequence: SmplSequence, turn: Float[np.ndarray, "3 3"]
) -> tuple[Float[np.ndarray, "T 3"], Float[np.ndarray, "T 3"]]:
    """Return the root's axis-angle and the pelvis in other axes."""
    root = Rotation.from_matrix(turn) * Rotation.from_rotvec(sequence.global_orient)
    return root.as_rotvec(), (sequence.transl + sequence.rest_joints[0]) @ turn.T


def betas_of(content: Mapping[str, Any]) -> Float[np.ndarray, "10"]:
    """Return the first ten shape coefficients of a file, zeros where it has none; a clip's mean."""
    found = numbers(content.get("betas", np.zeros(10)))
    with np.errstate(all="ignore"):
        mean = found.reshape(-1, found.shape[-1]).mean(0) if found.size else np.zeros(10)
    known = np.where(np.abs(mean) < LARGEST, mean, 0.0)
    return np.concatenate([known, np.zeros(10)])[:10]


def skeleton_of(content: Mapping[str, Any]) -> Float[np.ndarray, "29 3"]:
    """Return the rest joints of a file of ours, else our own skeleton."""
    found = numbers(content.get(REST_KEY, REST_JOINTS))
    good = found.shape == REST_JOINTS.shape and np.isfinite(found).all()
    return found if good else REST_JOINTS.copy()


def skeleton_under(
    rotations: Float[np.ndarray, "T 24 3 3"], points: Float[np.ndarray, "T 29 3"]
) -> Float[np.ndarray, "29 3"]:
    """Return the rest joints whose rotations best give the points, least squares over the clip.

    A bone is its parent's rotation times its rest offset, so that the offset is the mean of the
    bone seen from the parent.
    """
    turned = forward(rotations, REST_JOINTS[None], points[:, 0]).rotations
    offsets = np.zeros((len(PARENTS), 3))
    for index, parent in enumerate(PARENTS[1:], start=1):
        bone = points[:, index] - points[:, parent]
        offsets[index] = np.einsum("tji,tj->ti", turned[:, parent], bone).mean(0)
    return assemble(offsets)
