"""Schemas of the tables: columns with unit and frame, and required metadata.

A fixed-width list column is one vector a row; `Column.frame` names the axes in which a vector is
written (world: x forward, y left, z up).
"""

import pyarrow as pa

from robojackson.files.table_types import (
    F64,
    FLAG,
    I32,
    I64,
    TEXT,
    Column,
    TableSchema,
)

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
        Column("off_sites", FLAG, nullable=True),
        Column("off_ends", FLAG, nullable=True),
        Column("kneels", FLAG, nullable=True),
        Column("on_floor", FLAG, nullable=True),
        Column("end_height_error_m", F64, "m", nullable=True),
        Column("mpjpe_l_m", F64, "m", nullable=True),
        Column("mpjpe_g_m", F64, "m", nullable=True),
        Column("mpjpe_l_alive_m", F64, "m", nullable=True),
        Column("mpjpe_g_alive_m", F64, "m", nullable=True),
        Column("acceleration_ratio", F64, "1", nullable=True),
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

BEAT_RECORD = TableSchema(
    "BeatRecord",
    "motion",
    (
        *RUN_COLUMNS,
        Column("robot", TEXT),
        # person, reference, robot, or control: the last of them half a beat later.
        Column("motion", TEXT),
        Column("beats", I32),
        Column("precision", F64, "1"),
        Column("recall", F64, "1"),
        Column("f1", F64, "1"),
        Column("bas", F64, "1"),
    ),
)
