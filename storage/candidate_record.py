"""Columns of the catalogue of candidates: one row an assessment of a video."""

import pyarrow as pa

from robojackson.clips.quality.stability import STABILITY_SCORE
from robojackson.files.table_types import F64, I32, TEXT, Column, TableSchema
from robojackson.pipeline.table_schemas import VIDEO_CANDIDATE

TIME = pa.timestamp("us", tz="UTC")

QUALITY = (
    Column("detected_share", F64, "1", nullable=True),
    Column("full_body_share", F64, "1", nullable=True),
    Column("person_height_px", F64, "px", nullable=True),
    Column("people", I32, nullable=True),
    Column("cuts", I32, nullable=True),
    Column("static_share", F64, "1", nullable=True),
    Column("moving_share", F64, "1", nullable=True),
    Column("flat_share", F64, "1", nullable=True),
)
CANDIDATE_RECORD = TableSchema(
    "CandidateRecord",
    "assessment of a video",
    (
        Column("record_id", TEXT),
        Column("run_id", TEXT),
        Column("dance", TEXT),
        Column("source", TEXT),
        *VIDEO_CANDIDATE.columns,
        Column("thumbnail", TEXT, nullable=True),
        *(Column(c.name, c.type, c.unit, nullable=True) for c in STABILITY_SCORE.columns),
        *QUALITY,
        # chosen, accepted, rejected (by a filter) or failed (could not be downloaded or read)
        Column("decision", TEXT),
        Column("reason", TEXT, nullable=True),
        Column("decided_at", TIME),
        Column("video_key", TEXT, nullable=True),
        Column("video_sha256", TEXT, nullable=True),
    ),
)
