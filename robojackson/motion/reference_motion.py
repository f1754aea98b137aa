"""The target trajectory of a robot, one row a control step.

World frame: x forward, y left, z up, metres, the floor at z = 0; quaternions wxyz.
"""

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Int
from typing_extensions import TypedDict

from robojackson.files.fact_types import (
    Count,
    Figures,
    Flag,
    Numbers,
    Point,
    Step,
    Text,
    Texts,
)
from robojackson.files.json_types import to_json_types
from robojackson.files.table_file import Columns, Facts, TableFile, json_facts, numbered
from robojackson.files.table_types import F32, F64, I32, STATE, WORLD, Column, TableSchema
from robojackson.motion.certificate import Certificate, Finding

ARRAYS = ("qpos", "qvel", "body_pos_w", "keypoints_w", "contact", "torque_ratio")
NAMES = ("joint_names", "body_names", "keypoint_names", "contact_names")
UNIT = 1e-3
"""How far the length of a quaternion may be from one."""


class FoundFinding(TypedDict):
    """A finding of a certificate, as a file has it."""

    start: Count
    end: Count
    cause: Text
    what: Text
    repair: Text


class FoundCertificate(TypedDict):
    """A certificate, as a file has it."""

    slack: Numbers
    tempo: Numbers
    findings: list[FoundFinding]


REFERENCE_MOTION = TableSchema(
    "ReferenceMotion",
    "step",
    (
        Column("step", I32),
        Column("time_s", F64, "s"),
        # Not rounded to f32: a joint at its limit would end up beyond it.
        Column("qpos", F64, "m, wxyz, rad", WORLD, None, least=-1e4, most=1e4),
        Column("qvel", F64, "m/s, rad/s", "root linear: world; root angular: body", None),
        Column("body_pos_w", F32, "m", WORLD, None, least=-1e4, most=1e4),
        Column("keypoints_w", F32, "m", WORLD, None, least=-1e4, most=1e4),
        Column("contact", STATE, "0 air, 1 planted, 2 sliding", width=None, least=0, most=2),
        Column("torque_ratio", F32, "1", width=None),
        Column("source_time_s", F64, "s"),
    ),
    {
        "robot": Text,
        "model_sha256": Text,
        "dt": Step,
        "cyclic": Flag,
        "cycle_offset": Point,
        **dict.fromkeys(NAMES, Texts),
        "scorecard": Figures,
    },
    {"certificate": FoundCertificate, "robot_file": Text},
)


@dataclass(frozen=True, repr=False)
class ReferenceMotion(TableFile):
    """The motion for a robot to follow, at its control rate.

    A cyclic motion has `len(self)` steps a cycle and continues with its first step, moved by
    `cycle_offset`; a motion that is not cyclic ends at its last step.

    Attributes:
        robot: Name of the robot description.
        model_sha256: Digest of the MJCF that the motion was made for.
        dt: Seconds a control step (Humanoid-v5: 0.015).
        cyclic: Whether the motion may be looped.
        cycle_offset: Root displacement of one cycle, metres, world; zero unless cyclic.
        qpos: MuJoCo positions, root quaternion wxyz.
        qvel: MuJoCo velocities: root linear in the world, root angular in the body, hinges.
        body_pos_w: Origins of the bodies, metres, world.
        keypoints_w: The robot's own keypoint sites (hands and head among them), metres, world.
        contact: State of the robot's contact points: 0 air, 1 planted, 2 sliding.
        torque_ratio: |torque| / limit a hinge, from inverse dynamics; 0 where nothing drives it.
        source_time_s: Time in the source clip that each step shows, seconds.
        joint_names, body_names, keypoint_names, contact_names: What the columns are.
        scorecard: Figures of the quality of the motion.
        certificate: What the robot cannot do in it; None where it was not certified.
        robot_file: Path of the robot's YAML on the machine that made the motion; empty for one of
            `configs/robots`, and where a flow made it.
    """

    SCHEMA = REFERENCE_MOTION

    robot: str
    model_sha256: str
    dt: float
    cyclic: bool
    cycle_offset: Float[np.ndarray, "3"]
    qpos: Float[np.ndarray, "S nq"]
    qvel: Float[np.ndarray, "S nv"]
    body_pos_w: Float[np.ndarray, "S nbody 3"]
    keypoints_w: Float[np.ndarray, "S K 3"]
    contact: Int[np.ndarray, "S C"]
    torque_ratio: Float[np.ndarray, "S J"]
    source_time_s: Float[np.ndarray, " S"]
    joint_names: tuple[str, ...]
    body_names: tuple[str, ...]
    keypoint_names: tuple[str, ...]
    contact_names: tuple[str, ...]
    scorecard: Mapping[str, float] = field(default_factory=dict)
    certificate: Certificate | None = None
    robot_file: str = ""

    def __len__(self) -> int:
        return len(self.qpos)

    def __repr__(self) -> str:
        kind = "cyclic" if self.cyclic else "not cyclic"
        known = "tempo" in self.scorecard
        slow = f", tempo={tempo_beside_clip(self.scorecard):.2f}" if known else ""
        return (
            f"ReferenceMotion(robot={self.robot!r}, {len(self)} steps of {1000 * self.dt:g} ms, "
            f"{len(self) * self.dt:.1f} s, {kind}{slow})"
        )

    @property
    def in_clip(self) -> Bool[np.ndarray, " S"]:
        """The steps at which the clip goes on: not the stands and steps before and after it, which
        show its first and its last moment all along."""
        moves = np.diff(self.source_time_s) != 0
        result: np.ndarray = np.append(moves, False) | np.insert(moves, 0, False)
        return result

    def to_columns(self) -> tuple[Columns, Facts]:
        """Return the columns and the metadata of the table."""
        columns = numbered("step", len(self), self.dt)
        columns |= {name: np.asarray(getattr(self, name)) for name in (*ARRAYS, "source_time_s")}
        facts = {name: getattr(self, name) for name in REFERENCE_MOTION.metadata}
        facts["scorecard"] = to_json_types(self.scorecard)
        if self.certificate is not None:
            facts["certificate"] = asdict(self.certificate)
        if self.robot_file:
            facts["robot_file"] = self.robot_file
        return columns, json_facts(facts)

    @classmethod
    def from_columns(cls, columns: Columns, facts: Facts) -> "ReferenceMotion":
        """Build the object from columns and metadata."""
        arrays: dict[str, Any] = {name: columns[name] for name in ARRAYS}
        bodies, points = len(facts["body_names"]), len(facts["keypoint_names"])
        arrays["body_pos_w"] = arrays["body_pos_w"].reshape(-1, bodies, 3)
        arrays["keypoints_w"] = arrays["keypoints_w"].reshape(-1, points, 3)
        _require_widths(arrays, facts)
        return cls(
            robot=str(facts["robot"]),
            model_sha256=str(facts["model_sha256"]),
            dt=float(facts["dt"]),
            cyclic=bool(facts["cyclic"]),
            cycle_offset=np.array(facts["cycle_offset"], float),
            source_time_s=columns["source_time_s"],
            scorecard={k: np.nan if v is None else v for k, v in facts["scorecard"].items()},
            certificate=_certificate(facts),
            robot_file=str(facts.get("robot_file", "")),
            **(arrays | {name: tuple(facts[name]) for name in NAMES}),
        )


def _require_widths(arrays: Mapping[str, np.ndarray], facts: Facts) -> None:
    """Raise `ValueError` where a table has not a column a name, or its root is not turned."""
    joints, contacts = len(facts["joint_names"]), len(facts["contact_names"])
    widths = {"qpos": 7 + joints, "qvel": 6 + joints, "contact": contacts, "torque_ratio": joints}
    for name, width in widths.items():
        if arrays[name].shape[1] != width:
            raise ValueError(f"{name} has {arrays[name].shape[1]} numbers a row, not {width}")
    for name in NAMES:
        if len(set(facts[name])) < len(facts[name]):
            raise ValueError(f"{name} has a name twice")
    if (abs(np.linalg.norm(arrays["qpos"][:, 3:7], axis=1) - 1.0) > UNIT).any():
        raise ValueError("qpos: the root's quaternion has not length one")


def tempo_beside_clip(card: Mapping[str, Any]) -> float:
    """Return the tempo of a motion beside its clip's by its score card: the given one times what
    retargeting slowed it down to; 1 where the card has neither."""
    return float(card.get("tempo", 1.0)) * float(card.get("tempo_mean", 1.0))


def motions_of(
    references: ReferenceMotion | Sequence[ReferenceMotion],
) -> list[ReferenceMotion]:
    """Return one motion or several as a list."""
    return [references] if isinstance(references, ReferenceMotion) else list(references)


def _certificate(facts: Facts) -> Certificate | None:
    found = facts.get("certificate")
    if found is None:
        return None
    findings = tuple(Finding(**finding) for finding in found["findings"])
    return Certificate(np.array(found["slack"]), np.array(found["tempo"]), findings)


def poses_sha256(reference: ReferenceMotion) -> str:
    """Return the digest of what a robot has to do: the poses, and whether they go on for
    ever."""
    poses = np.ascontiguousarray(reference.qpos, float).tobytes()
    return hashlib.sha256(poses + bytes([reference.cyclic])).hexdigest()
