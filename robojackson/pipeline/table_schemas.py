"""What every table looks like: columns with unit and frame, and what its metadata must hold.

A fixed-width list column is one vector a row; `Column.frame` says in which axes a vector is
written (world: x forward, y left, z up).
"""

from collections.abc import Mapping
from dataclasses import dataclass

import pyarrow as pa

VERSION = 1
WORLD = "world"
F32, F64, I32, I64 = pa.float32(), pa.float64(), pa.int32(), pa.int64()
TEXT, FLAG, STATE = pa.string(), pa.bool_(), pa.int8()


@dataclass(frozen=True)
class Column:
    """One column.

    Attributes:
        name: Of the column or table.
        type: Of one number (or text).
        unit: SI symbol, `1` for a ratio, `` for what has none.
        frame: Axes of a vector, `` for a scalar.
        width: Numbers a row; 1 is a scalar, None a vector whose width the file itself tells.
        nullable: Whether a row may have none.
    """

    name: str
    type: pa.DataType
    unit: str = ""
    frame: str = ""
    width: int | None = 1
    nullable: bool = False

    @property
    def is_vector(self) -> bool:
        """Whether a row holds more than one number."""
        return self.width != 1

    def field(self, width: int | None = None) -> pa.Field:
        """The column in Arrow's words, with unit and frame in its metadata."""
        size = self.width or width or -1
        type_ = pa.list_(self.type, size) if self.is_vector else self.type
        notes = {"unit": self.unit, "frame": self.frame}
        return pa.field(self.name, type_, self.nullable, {k: v for k, v in notes.items() if v})


@dataclass(frozen=True)
class TableSchema:
    """One table.

    Attributes:
        name: Of the column or table.
        row: What one row is.
        columns: All fixed columns.
        metadata: Keys that the file's metadata must have (JSON values).
        dynamic: Beginnings of further columns, float64, nullable, with their unit; which of them a
            file has depends on the reward and the robot.
    """

    name: str
    row: str
    columns: tuple[Column, ...]
    metadata: tuple[str, ...] = ()
    dynamic: Mapping[str, str] | None = None

    def column(self, name: str) -> Column | None:
        """The column of that name, also a dynamic one; None where the table has no such column."""
        for column in self.columns:
            if column.name == name:
                return column
        for start, unit in (self.dynamic or {}).items():
            if name.startswith(start):
                return Column(name, F64, unit, nullable=True)
        return None


VIDEO_CANDIDATE = TableSchema(
    "VideoCandidate",
    "video",
    (
        Column("video_id", TEXT),
        Column("url", TEXT),
        Column("title", TEXT, nullable=True),
        Column("query", TEXT, nullable=True),
        Column("duration_s", F64, "s", nullable=True),
        Column("view_count", I64, nullable=True),
        Column("width", I32, "px", nullable=True),
        Column("height", I32, "px", nullable=True),
        Column("retrieved_at", pa.timestamp("us", tz="UTC")),
    ),
)

LANDMARK_TRACK = TableSchema(
    "LandmarkTrack",
    "frame",
    (
        Column("frame", I32),
        Column("time_s", F64, "s"),
        Column("landmarks", F32, "1", "image, divided by width and height", 99, nullable=True),
        Column("world_landmarks", F32, "m", "hips: x right, y down, z away", 99, nullable=True),
        Column("visibility", F32, "1", width=33, nullable=True),
    ),
    ("fps", "width", "height"),
)

STABILITY_SCORE = TableSchema(
    "StabilityScore",
    "clip",
    (
        Column("frames", I32),
        Column("detected", I32),
        Column("missing_joints", I32),
        Column("jitter", F64, "image sizes"),
        Column("stability_score", F64, "1"),
        Column("missing_joints_per_frame", F64, "1"),
        Column("jitter_per_frame", F64, "image sizes"),
    ),
)

SMPL_SEQUENCE = TableSchema(
    "SmplSequence",
    "frame",
    (
        Column("frame", I32),
        Column("time_s", F64, "s"),
        Column("global_orient", F32, "rad", WORLD, 3),
        Column("body_pose", F32, "rad", "parent joint", 69),
        Column("transl", F32, "m", WORLD, 3),
        Column("joints", F32, "m", WORLD, 72),
        Column("keypoints_w", F32, "m", WORLD, 87),
        Column("confidence", F32, "1", width=29),
        Column("contact", STATE, "0 air, 1 planted, 2 sliding", width=4),
        Column("valid", FLAG),
    ),
    ("fps", "betas", "rest_joints", "person", "camera", "notes"),
)

REFERENCE_MOTION = TableSchema(
    "ReferenceMotion",
    "step",
    (
        Column("step", I32),
        Column("time_s", F64, "s"),
        # Not rounded to f32: a joint at its limit would end up beyond it.
        Column("qpos", F64, "m, wxyz, rad", WORLD, None),
        Column("qvel", F64, "m/s, rad/s", "root linear: world; root angular: body", None),
        Column("body_pos_w", F32, "m", WORLD, None),
        Column("keypoints_w", F32, "m", WORLD, None),
        Column("contact", STATE, "0 air, 1 planted, 2 sliding", width=None),
        Column("torque_ratio", F32, "1", width=None),
        Column("source_time_s", F64, "s"),
    ),
    (
        "robot",
        "model_sha256",
        "dt",
        "cyclic",
        "cycle_offset",
        "joint_names",
        "body_names",
        "keypoint_names",
        "contact_names",
        "scorecard",
    ),
)

ROLLOUT = TableSchema(
    "Rollout",
    "step",
    (
        Column("step", I32),
        Column("time_s", F64, "s"),
        Column("qpos", F64, "m, wxyz, rad", WORLD, None),
    ),
    ("dt",),
)

RUN_COLUMNS = (
    Column("run_id", TEXT),
    Column("move", TEXT),
    Column("setup", TEXT),
    Column("seed", I32),
)

EPISODE_RECORD = TableSchema(
    "EpisodeRecord",
    "episode",
    (
        *RUN_COLUMNS,
        Column("step", I64),
        Column("episode", I64),
        Column("seconds", F64, "s", nullable=True),
        Column("episode_return", F64, "1"),
        Column("episode_length", I32, "steps"),
        Column("site_error_m", F64, "m", nullable=True),
        Column("survived_s", F64, "s", nullable=True),
    ),
    dynamic={"reward_": "1", "error_": "", "train_": ""},
)

EVALUATION_RECORD = TableSchema(
    "EvaluationRecord",
    "rollout",
    (
        *RUN_COLUMNS,
        Column("step", I64, nullable=True),
        Column("seconds", F64, "s", nullable=True),
        Column("policy", TEXT),
        # Step of the clip at which the rollout starts; -1 is the default stand.
        Column("phase", I32, "step"),
        Column("reset", I32),
        Column("integrator", TEXT, nullable=True),
        Column("tempo", F64, "1", nullable=True),
        Column("survived_s", F64, "s"),
        Column("clip_fraction", F64, "1"),
        Column("success", F64, "1"),
        Column("strict_success", F64, "1"),
        Column("skill", F64, "1", nullable=True),
        Column("velocity_score", F64, "1", nullable=True),
        Column("site_error_m", F64, "m", nullable=True),
        Column("drift_m", F64, "m", nullable=True),
        Column("heading_error_deg", F64, "deg", nullable=True),
        Column("travel_ratio", F64, "1", nullable=True),
        Column("fell", FLAG),
        Column("kneels", FLAG, nullable=True),
    ),
    dynamic={
        "limb_gain_": "1",
        "limb_r2_": "1",
        "limb_lag_": "s",
        "usage_": "1",
        "return_": "1",
        "excess_speed_": "m/s",
        "reward_": "1",
        "error_": "",
    },
)

TABLES = {
    table.name: table
    for table in (
        VIDEO_CANDIDATE,
        LANDMARK_TRACK,
        STABILITY_SCORE,
        SMPL_SEQUENCE,
        REFERENCE_MOTION,
        ROLLOUT,
        EPISODE_RECORD,
        EVALUATION_RECORD,
    )
}
