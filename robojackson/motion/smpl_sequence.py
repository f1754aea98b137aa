"""A human motion: SMPL parameters, the joints that they pose, and what is known about each frame.

World frame: x forward, y left, z up, metres, the floor at z = 0. Rotations are axis-angle, radians.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from jaxtyping import Float, Int
from typing_extensions import TypedDict

from robojackson.files.fact_types import (
    Count,
    Flag,
    Matrix,
    Number,
    Pixels,
    Point,
    Rate,
    Text,
    Texts,
    many,
)
from robojackson.files.table_file import Columns, Facts, TableFile, json_facts, numbered
from robojackson.files.table_types import F32, F64, FLAG, I32, STATE, WORLD, Column, TableSchema

CONTACT_POINTS: tuple[str, ...] = ("left_heel", "left_toe", "right_heel", "right_toe")
AIR, PLANTED, SLIDING = 0, 1, 2
REACH_M = 1e4
"""How far from the origin a body may be, metres."""


class Camera(TypedDict, total=False):
    """The camera, where it is known; other keys may stand beside these."""

    focal_px: Number
    width: Pixels
    height: Pixels
    gravity: Text
    tilt_deg: Number
    gravity_sd_deg: Number
    gravity_sure: Flag
    position_w: Point | list[Point]
    rotation_w: Matrix | list[Matrix]


ARRAYS = (
    "global_orient",
    "body_pose",
    "transl",
    "joints",
    "keypoints_w",
    "confidence",
    "contact",
    "valid",
)
SMPL_SEQUENCE = TableSchema(
    "SmplSequence",
    "frame",
    (
        Column("frame", I32),
        Column("time_s", F64, "s"),
        Column("global_orient", F32, "rad", WORLD, 3),
        Column("body_pose", F32, "rad", "parent joint", 69),
        Column("transl", F32, "m", WORLD, 3, least=-REACH_M, most=REACH_M),
        Column("joints", F32, "m", WORLD, 72, least=-REACH_M, most=REACH_M),
        Column("keypoints_w", F32, "m", WORLD, 87, least=-REACH_M, most=REACH_M),
        Column("confidence", F32, "1", width=29),
        Column("contact", STATE, "0 air, 1 planted, 2 sliding", width=4, least=AIR, most=SLIDING),
        Column("valid", FLAG),
    ),
    {
        "fps": Rate,
        "betas": many(Number, 10),
        "rest_joints": many(Point, 29),
        "person": Count,
        "camera": Camera,
        "notes": Texts,
    },
)


@dataclass(frozen=True, repr=False)
class SmplSequence(TableFile):
    """One person's motion, one row a frame.

    Attributes:
        fps: Frames a second; frame t is at t / fps seconds.
        global_orient: Root rotation, axis-angle, radians, world.
        body_pose: Rotations of joints 1..23 relative to their parents, axis-angle, radians.
        transl: SMPL translation, metres: pelvis = transl + rest_joints[0].
        joints: The 24 SMPL joints, metres, world.
        keypoints_w: HybrIK's 29 keypoints, metres, world (`body.skeleton.KEYPOINT_NAMES`).
        confidence: 0..1 a keypoint.
        contact: AIR, PLANTED or SLIDING for `CONTACT_POINTS`.
        valid: False where the person was not detected and the pose is interpolated.
        betas: SMPL shape coefficients, zero when the skeleton is our own.
        rest_joints: The T-pose that the parameters pose, metres, x left, y up, z forward (SMPL).
        person: Index of the tracked person in the clip.
        camera: focal_px, width, height and the pose of the camera in the world.
        notes: Warnings for the user, such as a camera that moved.
    """

    SCHEMA = SMPL_SEQUENCE

    fps: float
    global_orient: Float[np.ndarray, "T 3"]
    body_pose: Float[np.ndarray, "T 69"]
    transl: Float[np.ndarray, "T 3"]
    joints: Float[np.ndarray, "T 24 3"]
    keypoints_w: Float[np.ndarray, "T 29 3"]
    confidence: Float[np.ndarray, "T 29"]
    contact: Int[np.ndarray, "T 4"]
    valid: np.ndarray
    betas: Float[np.ndarray, "10"]
    rest_joints: Float[np.ndarray, "29 3"]
    person: int = 0
    camera: Mapping[str, object] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.global_orient)

    def __repr__(self) -> str:
        planted = (self.contact == PLANTED).any(1).mean() if len(self) else 0.0
        return (
            f"SmplSequence({len(self)} frames at {self.fps:g} fps, {len(self) / self.fps:.1f} s, "
            f"{int(np.sum(self.valid))} detected, foot planted in {planted:.0%}, "
            f"person={self.person})"
        )

    def part(self, frames: slice) -> "SmplSequence":
        """Return some frames of the motion."""
        return replace(self, **{name: getattr(self, name)[frames] for name in ARRAYS})

    def to_columns(self) -> tuple[Columns, Facts]:
        """Return the columns and the metadata of the table."""
        columns = numbered("frame", len(self), 1.0 / self.fps)
        columns |= {name: np.asarray(getattr(self, name)) for name in ARRAYS}
        return columns, json_facts({name: getattr(self, name) for name in SMPL_SEQUENCE.metadata})

    @classmethod
    def from_columns(cls, columns: Columns, facts: Facts) -> "SmplSequence":
        """Build the object from columns and metadata."""
        if not columns["valid"].any():
            raise ValueError("no frame shows the person: valid is false everywhere")
        arrays = {name: columns[name] for name in ARRAYS}
        arrays["joints"] = arrays["joints"].reshape(-1, 24, 3)
        arrays["keypoints_w"] = arrays["keypoints_w"].reshape(-1, 29, 3)
        return cls(
            fps=float(facts["fps"]),
            betas=np.array(facts["betas"], float),
            rest_joints=np.array(facts["rest_joints"], float).reshape(29, 3),
            person=int(facts["person"]),
            camera=dict(facts["camera"]),
            notes=tuple(facts["notes"]),
            **arrays,
        )
