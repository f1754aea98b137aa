"""How each dataclass of the stages is taken apart into columns and put together again."""

import json
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from robojackson.clips.quality.stability import Stability
from robojackson.errors import UnknownName
from robojackson.motion.certificate import Certificate, Finding
from robojackson.motion.landmark_track import LandmarkTrack, uneven
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.motion.smpl_sequence import SmplSequence
from robojackson.pipeline import table_schemas
from robojackson.pipeline.table_schemas import TableSchema

Columns = dict[str, np.ndarray]
Facts = dict[str, Any]


@dataclass(frozen=True)
class Rollout:
    """What the robot did, one row a control step, world frame.

    Attributes:
        dt: Seconds a control step.
        qpos: MuJoCo positions.
    """

    dt: float
    qpos: Float[np.ndarray, "S nq"]


@dataclass(frozen=True)
class Codec:
    """One dataclass and its table.

    Attributes:
        schema: Of the table.
        to_columns: Value to columns and metadata.
        from_columns: Columns and metadata to value.
    """

    schema: TableSchema
    to_columns: Callable[[Any], tuple[Columns, Facts]]
    from_columns: Callable[[Columns, Facts], Any]


def codec_of(cls: type) -> Codec:
    """The codec of a dataclass.

    Raises:
        UnknownName: there is no table for it.
    """
    if cls not in CODECS:
        raise UnknownName(
            "table", cls.__name__, "robojackson.pipeline.table_codecs", (c.__name__ for c in CODECS)
        )
    return CODECS[cls]


def _track_apart(track: LandmarkTrack) -> tuple[Columns, Facts]:
    columns = _numbered("frame", len(track), 1.0 / track.fps) | {"time_s": track.times}
    for name in ("landmarks", "world_landmarks", "visibility"):
        columns[name] = getattr(track, name)
    facts = {name: getattr(track, name) for name in ("fps", "width", "height", "person", "notes")}
    if track.to_first is not None:
        facts["to_first"] = track.to_first.tolist()
    return columns, facts


def _track(columns: Columns, facts: Facts) -> LandmarkTrack:
    return LandmarkTrack(
        fps=float(facts["fps"]),
        width=int(facts["width"]),
        height=int(facts["height"]),
        landmarks=columns["landmarks"].reshape(-1, 33, 3),
        world_landmarks=columns["world_landmarks"].reshape(-1, 33, 3),
        visibility=columns["visibility"],
        time_s=columns["time_s"] if uneven(columns["time_s"], float(facts["fps"])) else None,
        person=int(facts.get("person", 0)),
        notes=tuple(facts.get("notes", ())),
        to_first=np.array(facts["to_first"]) if "to_first" in facts else None,
    )


def _stability_apart(score: Stability) -> tuple[Columns, Facts]:
    names = (column.name for column in table_schemas.STABILITY_SCORE.columns)
    return {name: np.array([getattr(score, name)]) for name in names}, {}


def _stability(columns: Columns, facts: Facts) -> Stability:
    return Stability(**{name: values[0].item() for name, values in columns.items()})


SMPL_ARRAYS = (
    "global_orient",
    "body_pose",
    "transl",
    "joints",
    "keypoints_w",
    "confidence",
    "contact",
    "valid",
)


def _smpl_apart(sequence: SmplSequence) -> tuple[Columns, Facts]:
    columns = _numbered("frame", len(sequence), 1.0 / sequence.fps)
    columns |= {name: np.asarray(getattr(sequence, name)) for name in SMPL_ARRAYS}
    facts = {name: getattr(sequence, name) for name in table_schemas.SMPL_SEQUENCE.metadata}
    return columns, _json_types(facts)


def _smpl(columns: Columns, facts: Facts) -> SmplSequence:
    arrays = {name: columns[name] for name in SMPL_ARRAYS}
    arrays["joints"] = arrays["joints"].reshape(-1, 24, 3)
    arrays["keypoints_w"] = arrays["keypoints_w"].reshape(-1, 29, 3)
    return SmplSequence(
        fps=float(facts["fps"]),
        betas=np.array(facts["betas"], float),
        rest_joints=np.array(facts["rest_joints"], float).reshape(29, 3),
        person=int(facts["person"]),
        camera=dict(facts["camera"]),
        notes=tuple(facts["notes"]),
        **arrays,
    )


REFERENCE_ARRAYS = ("qpos", "qvel", "body_pos_w", "keypoints_w", "contact", "torque_ratio")
REFERENCE_NAMES = ("joint_names", "body_names", "keypoint_names", "contact_names")


def _reference_apart(reference: ReferenceMotion) -> tuple[Columns, Facts]:
    columns = _numbered("step", len(reference), reference.dt)
    for name in (*REFERENCE_ARRAYS, "source_time_s"):
        columns[name] = np.asarray(getattr(reference, name))
    facts = {name: getattr(reference, name) for name in table_schemas.REFERENCE_MOTION.metadata}
    if reference.certificate is not None:
        facts["certificate"] = asdict(reference.certificate)
    return columns, _json_types(facts)


def _certificate(facts: Facts) -> Certificate | None:
    found = facts.get("certificate")
    if found is None:
        return None
    findings = tuple(Finding(**finding) for finding in found["findings"])
    return Certificate(np.array(found["slack"]), np.array(found["tempo"]), findings)


def _reference(columns: Columns, facts: Facts) -> ReferenceMotion:
    arrays: dict[str, Any] = {name: columns[name] for name in REFERENCE_ARRAYS}
    bodies, points = len(facts["body_names"]), len(facts["keypoint_names"])
    arrays["body_pos_w"] = arrays["body_pos_w"].reshape(-1, bodies, 3)
    arrays["keypoints_w"] = arrays["keypoints_w"].reshape(-1, points, 3)
    return ReferenceMotion(
        robot=str(facts["robot"]),
        model_sha256=str(facts["model_sha256"]),
        dt=float(facts["dt"]),
        cyclic=bool(facts["cyclic"]),
        cycle_offset=np.array(facts["cycle_offset"], float),
        source_time_s=columns["source_time_s"],
        scorecard=dict(facts["scorecard"]),
        certificate=_certificate(facts),
        **(arrays | {name: tuple(facts[name]) for name in REFERENCE_NAMES}),
    )


def _rollout_apart(rollout: Rollout) -> tuple[Columns, Facts]:
    columns = _numbered("step", len(rollout.qpos), rollout.dt)
    return columns | {"qpos": rollout.qpos}, {"dt": rollout.dt}


def _rollout(columns: Columns, facts: Facts) -> Rollout:
    return Rollout(dt=float(facts["dt"]), qpos=columns["qpos"])


CODECS: Mapping[type, Codec] = {
    LandmarkTrack: Codec(table_schemas.LANDMARK_TRACK, _track_apart, _track),
    Stability: Codec(table_schemas.STABILITY_SCORE, _stability_apart, _stability),
    SmplSequence: Codec(table_schemas.SMPL_SEQUENCE, _smpl_apart, _smpl),
    ReferenceMotion: Codec(table_schemas.REFERENCE_MOTION, _reference_apart, _reference),
    Rollout: Codec(table_schemas.ROLLOUT, _rollout_apart, _rollout),
}


def _numbered(index: str, rows: int, period_s: float) -> Columns:
    return {index: np.arange(rows, dtype=np.int32), "time_s": np.arange(rows) * period_s}


def _json_types(value: Any) -> Any:
    """The same in JSON's types."""
    return json.loads(json.dumps(value, default=_array))


def _array(value: Any) -> Any:
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if isinstance(value, Mapping):
        return dict(value)
    raise TypeError(f"{type(value).__name__} does not fit into a table's metadata")
