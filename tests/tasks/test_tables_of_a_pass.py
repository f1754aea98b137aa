"""The tables in the folder of a dance are those of its run, whoever made them first."""

from pathlib import Path

import pytest

from robojackson.files import tables
from robojackson.files.table_types import TableSchema
from storage import study_tables
from storage.artifact import Artifact
from storage.store import Store
from tasks.publish_tables import content_at, place_of_pass
from tasks.train_policy import RunLabels

LABELS = RunLabels("other-dance", "scratch")
MADE = {
    "policy": Artifact("train/p/policy.safetensors", "a" * 64),
    "evaluation": Artifact("evaluate/e/evaluation.json", "b" * 64),
}


@pytest.mark.parametrize(
    ("tracker", "expected"),
    [(None, "other-dance-scratch-s3-aaaaaaaa"), ("twist2", "other-dance-twist2-s0-bbbbbbbb")],
)
def test_a_run_is_called_by_what_dances(tracker: str | None, expected: str) -> None:
    assert place_of_pass(MADE, LABELS, tracker, 3).run_id == expected


def row_of(schema: TableSchema) -> dict[str, object]:
    named = {"run_id": "hip_shake-scratch-s0", "move": "hip_shake", "setup": "scratch", "seed": 0}
    blank = {"bool": False, "string": "", "int32": 0, "int64": 0}
    return {
        column.name: named.get(column.name, blank.get(str(column.type), 0.0))
        for column in schema.columns
    }


@pytest.mark.parametrize("table", study_tables.CELL)
def test_a_table_of_another_dance_gets_the_names_of_this_one(table: str, tmp_path: Path) -> None:
    schema, store = study_tables.CELL[table], Store(tmp_path)
    place = place_of_pass(MADE, LABELS, None, 0)
    before = row_of(schema)
    made = store.save("train", f"{table}.parquet", tables.encode_rows(schema, [before]))
    (after,) = tables.decode_rows(schema, content_at(place, store, table, made), table)
    (same,) = tables.decode_rows(schema, store.read(made.key), table)
    names = {name: getattr(place, name) for name in ("run_id", "move", "setup", "seed")}
    assert after == {**same, **names} != same


def test_what_is_no_table_of_a_run_is_left_as_it_is(tmp_path: Path) -> None:
    store = Store(tmp_path)
    made = store.save("dance", "dance.mp4", b"film")
    assert content_at(place_of_pass(MADE, LABELS, None, 0), store, "dance", made) == b"film"
