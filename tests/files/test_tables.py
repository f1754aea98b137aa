"""What is written is read back, and a file that violates its schema is refused by column."""

import io
import re
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from robojackson.clips.quality.stability import Stability
from robojackson.errors import BadTable, StoreError
from robojackson.files import table_door, tables
from robojackson.motion.landmark_track import LANDMARK_TRACK, LandmarkTrack
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.motion.rollout import Rollout
from robojackson.motion.smpl_sequence import SMPL_SEQUENCE, SmplSequence
from robojackson.pipeline.table_schemas import (
    EPISODE_RECORD,
    EVALUATION_RECORD,
)
from storage import artifact_tables
from storage.store import Store


def f32(rng: np.random.Generator, *shape: int) -> np.ndarray:
    """Return numbers that a float32 column holds exactly."""
    return rng.normal(size=shape).astype(np.float32).astype(float)


def a_track(rng: np.random.Generator) -> LandmarkTrack:
    track = LandmarkTrack(29.97, 64, 48, f32(rng, 5, 33, 3), f32(rng, 5, 33, 3), f32(rng, 5, 33))
    for array in (track.landmarks, track.world_landmarks, track.visibility):
        array[2] = np.nan
    return track


def a_sequence(rng: np.random.Generator) -> SmplSequence:
    return SmplSequence(
        fps=30.0,
        global_orient=f32(rng, 5, 3),
        body_pose=f32(rng, 5, 69),
        transl=f32(rng, 5, 3),
        joints=f32(rng, 5, 24, 3),
        keypoints_w=f32(rng, 5, 29, 3),
        confidence=f32(rng, 5, 29),
        contact=rng.integers(0, 3, (5, 4)).astype(np.int8),
        valid=np.array([True, True, False, True, True]),
        betas=rng.normal(size=10),
        rest_joints=rng.normal(size=(29, 3)),
        person=1,
        camera={"focal_px": 800.0, "rotation": rng.normal(size=(3, 3))},
        notes=("the camera moved",),
    )


def a_reference(rng: np.random.Generator) -> ReferenceMotion:
    qpos = rng.normal(size=(6, 24))
    qpos[:, 3:7] /= np.linalg.norm(qpos[:, 3:7], axis=1, keepdims=True)
    return ReferenceMotion(
        robot="humanoid",
        model_sha256="0" * 64,
        dt=0.015,
        cyclic=True,
        cycle_offset=rng.normal(size=3),
        qpos=qpos,
        qvel=rng.normal(size=(6, 23)),
        body_pos_w=f32(rng, 6, 13, 3),
        keypoints_w=f32(rng, 6, 14, 3),
        contact=rng.integers(0, 3, (6, 2)).astype(np.int8),
        torque_ratio=f32(rng, 6, 17),
        source_time_s=rng.normal(size=6),
        joint_names=tuple("abcdefghijklmnopq"),
        body_names=tuple("abcdefghijklm"),
        keypoint_names=tuple("abcdefghijklmn"),
        contact_names=("left_foot", "right_foot"),
        scorecard={"bone_angle_deg": 7.25},
    )


def a_stability(rng: np.random.Generator) -> Stability:
    return Stability(10, 9, 41, float(rng.normal()), 41.5, 4.1, 0.05, 125.0)


def a_rollout(rng: np.random.Generator) -> Rollout:
    return Rollout(0.015, rng.normal(size=(7, 24)))


MAKERS = [a_track, a_sequence, a_reference, a_stability, a_rollout]


def same(one: object, other: object) -> bool:
    if isinstance(one, dict):
        return set(one) == set(other) and all(same(v, other[k]) for k, v in one.items())
    if isinstance(one, np.ndarray):
        return np.array_equal(one, np.asarray(other), equal_nan=one.dtype.kind == "f")
    return one == other


@pytest.mark.parametrize("make", MAKERS)
def test_reading_restores_what_was_written(make) -> None:
    value = make(np.random.default_rng(1))
    loaded = tables.decode(type(value), tables.encode(value), "a file")
    different = [
        f.name for f in fields(value) if not same(getattr(value, f.name), getattr(loaded, f.name))
    ]
    assert different == []


@pytest.mark.parametrize("make", MAKERS)
def test_equal_values_make_equal_files(make) -> None:
    first, second = (tables.encode(make(np.random.default_rng(1))) for _ in range(2))
    assert first == second


def test_an_undetected_frame_stays_as_a_row_of_nulls() -> None:
    table = pq.read_table(io.BytesIO(tables.encode(a_track(np.random.default_rng(1)))))
    assert [table.column("landmarks").null_count, table.num_rows] == [1, 5]


def test_a_vector_is_a_fixed_size_list_of_float32() -> None:
    table = pq.read_table(io.BytesIO(tables.encode(a_sequence(np.random.default_rng(1)))))
    assert table.schema.field("body_pose").type == pa.list_(pa.float32(), 69)


def test_units_and_frames_stand_in_the_file() -> None:
    table = pq.read_table(io.BytesIO(tables.encode(a_sequence(np.random.default_rng(1)))))
    assert table.schema.field("transl").metadata == {b"unit": b"m", b"frame": b"world"}


def test_fps_stands_in_the_file() -> None:
    table = pq.read_table(io.BytesIO(tables.encode(a_sequence(np.random.default_rng(1)))))
    assert table_door.metadata_of(table)["fps"] == 30.0


def rewritten(change) -> bytes:
    table = pq.read_table(io.BytesIO(tables.encode(a_sequence(np.random.default_rng(1)))))
    sink = io.BytesIO()
    pq.write_table(change(table), sink)
    return sink.getvalue()


def as_column(values: object):
    def change(table: pa.Table) -> pa.Table:
        return table.set_column(table.column_names.index("transl"), "transl", values)

    return change


def plain(name: str, values: list, kind: pa.DataType | None = None):
    def change(table: pa.Table) -> pa.Table:
        return table.set_column(table.column_names.index(name), name, pa.array(values, kind))

    return change


def with_nan(table: pa.Table) -> pa.Table:
    values = np.zeros((5, 3), np.float32)
    values[3, 1] = np.nan
    return as_column(pa.FixedSizeListArray.from_arrays(values.ravel(), 3))(table)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda t: t.drop_columns(["transl"]), "'transl' of SmplSequence is missing"),
        (as_column(pa.array(["x"] * 5)), "'transl' is string, expected fixed_size_list"),
        (
            as_column(pa.array([[0.0] * 4] * 5, pa.list_(pa.float32(), 4))),
            r"'transl' is fixed_size_list.*\[4\]",
        ),
        (as_column(pa.array([[0.0] * 3] * 4 + [None], pa.list_(pa.float32(), 3))), "1 empty rows"),
        (with_nan, "'transl' holds NaN"),
        (lambda t: t.append_column("mood", pa.array([1] * 5)), "'mood' is not one of SmplSequence"),
        (lambda t: t.replace_schema_metadata({}), "metadata key 'fps'"),
        (plain("frame", [4, 3, 2, 1, 0], pa.int32()), "frame does not count the rows"),
        (plain("frame", [1, 2, 3, 4, 5], pa.int32()), "frame does not count the rows"),
        (plain("time_s", [0.0, 0.2, 0.1, 0.3, 0.4]), "time_s does not go on"),
        (plain("time_s", [0.0] * 5), "time_s does not go on"),
        (plain("valid", [False] * 5), "no frame shows the person"),
    ],
)
def test_a_violated_schema_names_column_and_file(change, message) -> None:
    with pytest.raises(BadTable, match=message) as caught:
        tables.decode(SmplSequence, rewritten(change), "runs/smpl.parquet")
    assert str(caught.value).startswith("runs/smpl.parquet: ")


def test_metadata_of_the_wrong_shape_is_refused() -> None:
    data = rewritten(lambda t: t.replace_schema_metadata({**t.schema.metadata, b"betas": b'"x"'}))
    with pytest.raises(BadTable, match=r"metadata of SmplSequence is wrong"):
        tables.decode(SmplSequence, data, "smpl.parquet")


def test_a_foreign_file_is_refused() -> None:
    with pytest.raises(BadTable, match=r"walk\.parquet: not a Parquet file"):
        tables.decode(SmplSequence, b"id,name\n1,walk\n", "walk.parquet")


def test_another_table_is_refused() -> None:
    data = tables.encode(a_track(np.random.default_rng(1)))
    result = "holds a LandmarkTrack, expected a SmplSequence; `robojackson mocap` writes one"
    with pytest.raises(BadTable, match=result):
        tables.decode(SmplSequence, data, "landmarks.parquet")


@pytest.mark.parametrize("moved", [False, True])
def test_the_path_of_a_camera_survives_with_its_track(moved: bool) -> None:
    rng = np.random.default_rng(2)
    to_first = rng.normal(size=(5, 3, 3)) if moved else None
    track = replace(a_track(rng), to_first=to_first)
    found = tables.decode(LandmarkTrack, tables.encode(track), "here").to_first
    assert (found is None) if to_first is None else np.array_equal(found, to_first)


@pytest.mark.parametrize("count", [None, 0, 3])
def test_the_edges_of_the_scene_survive_with_their_track(count: int | None) -> None:
    rng = np.random.default_rng(2)
    edges = None if count is None else rng.uniform(0, 500, (count, 4)).round(2)
    track = replace(a_track(rng), edges=edges)
    found = tables.decode(LandmarkTrack, tables.encode(track), "here").edges
    assert (found is None) if edges is None else np.array_equal(found, edges)


def test_an_artifact_leads_to_its_value(tmp_path: Path) -> None:
    store, track = Store(tmp_path), a_track(np.random.default_rng(1))
    artifact = artifact_tables.save(store, "landmarks", "landmarks.parquet", track)
    assert same(artifact_tables.read(LandmarkTrack, store, artifact).landmarks, track.landmarks)


COMMON = {"run_id": "r", "move": "walk", "setup": "scratch", "seed": 0}
EPISODE = {**COMMON, "step": 10, "episode": 1, "episode_return": 2.5, "episode_length": 40}


def test_rows_keep_their_reward_terms() -> None:
    rows = [{**EPISODE, "reward_sites": 0.5}, {**EPISODE, "reward_sites": np.float32(0.25)}]
    loaded = tables.decode_rows(EPISODE_RECORD, tables.encode_rows(EPISODE_RECORD, rows), "f")
    assert [row["reward_sites"] for row in loaded] == [0.5, 0.25]


def test_a_row_without_a_needed_column_is_refused() -> None:
    row = {name: value for name, value in EPISODE.items() if name != "episode_length"}
    with pytest.raises(BadTable, match="'episode_length' is empty in 1 rows"):
        tables.encode_rows(EPISODE_RECORD, [row])


def test_a_row_with_an_unknown_column_is_refused() -> None:
    with pytest.raises(BadTable, match="'mood' is not one of EpisodeRecord"):
        tables.encode_rows(EPISODE_RECORD, [{**EPISODE, "mood": 1.0}])


def test_a_row_with_a_wrong_value_names_its_column() -> None:
    with pytest.raises(BadTable, match="'episode_length'"):
        tables.encode_rows(EPISODE_RECORD, [{**EPISODE, "episode_length": "long"}])


def test_rows_of_before_a_column_was_added_are_read() -> None:
    """153 rows of the learning benchmark have no `off_sites`; each user's store has such rows."""
    whole = pq.read_table(io.BytesIO(tables.encode_rows(EVALUATION_RECORD, [])))
    sink = io.BytesIO()
    pq.write_table(whole.drop_columns(["off_sites", "mpjpe_l_m"]), sink)
    read = tables.decode_table(EVALUATION_RECORD, sink.getvalue(), "f")
    assert read.column_names == [c.name for c in EVALUATION_RECORD.columns]


def test_an_empty_table_has_all_columns() -> None:
    table = pq.read_table(io.BytesIO(tables.encode_rows(EVALUATION_RECORD, [])))
    assert table.column_names == [c.name for c in EVALUATION_RECORD.columns]


@pytest.mark.parametrize("schema", [LANDMARK_TRACK, SMPL_SEQUENCE])
def test_every_measured_column_has_a_unit(schema) -> None:
    plain = {"frame", "contact", "valid"}
    assert [c.name for c in schema.columns if not c.unit and c.name not in plain] == []


@pytest.mark.parametrize(
    ("table", "name"),
    [
        (LandmarkTrack, "landmarks.parquet"),
        (SmplSequence, "smpl.parquet"),
        (ReferenceMotion, "reference.parquet"),
    ],
)
def test_a_folder_in_place_of_a_table_is_refused_with_the_file_in_it(
    table: type[LandmarkTrack | SmplSequence | ReferenceMotion], name: str, tmp_path: Path
) -> None:
    with pytest.raises(StoreError, match=r"a folder, not a file$"):
        table.load(tmp_path)
    (tmp_path / name).touch()
    with pytest.raises(StoreError, match=rf"did you mean {re.escape(str(tmp_path / name))}\?$"):
        table.load(tmp_path)
