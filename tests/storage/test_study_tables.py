"""The tables of the studies: one file a cell, the same bytes each time, questions in SQL."""

import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest

from robojackson.errors import BadTable
from robojackson.files import tables
from robojackson.pipeline.table_schemas import EPISODE_RECORD, EVALUATION_RECORD
from robojackson.rl.config.evaluate_config import VARIANTS
from storage import study_tables
from storage.artifact import Artifact
from storage.store import Store
from storage.study_overview import OVERVIEW

NAMES = {"run_id": "other", "move": "other", "setup": "other", "seed": 9}


@pytest.fixture
def store(tmp_path: Path) -> Store:
    return Store(tmp_path)


def cell(seed: int = 0, run_id: str = "r1", setup: str = "scratch") -> study_tables.Place:
    return study_tables.Place("smoke", "walk", setup, seed, run_id)


def made(store: Store, survived: float = 1.0) -> dict[str, Artifact]:
    """Return the artifacts of a cell, under the names of another cell."""
    episode = {"step": 10, "episode": 0, "episode_return": 2.5, "episode_length": 10}
    rollout = {"policy": "trained", "phase": 0, "reset": 0, "survived_s": survived, "fell": False}
    rollout |= {"clip_fraction": 1.0, "success": 1.0, "strict_success": 0.0}
    rows = {"episodes": (EPISODE_RECORD, episode), "evaluations": (EVALUATION_RECORD, rollout)}
    return {
        name: store.save("stage", f"{name}.parquet", tables.encode_rows(schema, [{**NAMES, **row}]))
        for name, (schema, row) in rows.items()
    }


def test_rows_get_the_names_of_the_cell_they_are_published_for(store: Store) -> None:
    study_tables.write(store, cell(seed=3), made(store))
    (row,) = study_tables.query(store, "SELECT study, move, setup, seed, run_id FROM episodes")
    assert row == {"study": "smoke", "move": "walk", "setup": "scratch", "seed": 3, "run_id": "r1"}


def test_the_same_cell_again_writes_the_same_bytes_under_the_same_key(store: Store) -> None:
    first = study_tables.write(store, cell(), made(store))
    assert study_tables.write(store, cell(), made(store)) == first


def test_a_table_that_is_there_is_not_written_again(
    store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    first = study_tables.write(store, cell(), made(store))
    given = made(store)
    monkeypatch.setattr(store, "put", lambda key, content: pytest.fail(f"{key} was written"))
    assert study_tables.write(store, cell(), given) == first


def test_the_files_of_a_study_are_its_tables_and_notes_alone(store: Store) -> None:
    other = study_tables.Place("other", "walk", "scratch", 0, "r9")
    for place in (cell(), other):
        study_tables.write(store, place, made(store))
        study_tables.note(store, place, {"run_id": place.run_id})
    keys = {artifact.key for artifact in study_tables.files_of(store, "smoke")}
    assert keys == {
        cell().key("episodes"),
        cell().key("evaluations"),
        study_tables.note_key(cell()),
    }


def test_a_question_about_a_study_sees_no_other(store: Store) -> None:
    study_tables.write(store, cell(), made(store))
    study_tables.write(store, study_tables.Place("other", "walk", "scratch", 0, "r9"), made(store))
    with study_tables.opened(store, "smoke") as ask:
        assert ask("SELECT DISTINCT study FROM episodes") == [{"study": "smoke"}]


def test_a_cell_that_was_trained_again_replaces_its_rows(store: Store) -> None:
    for run_id, survived in (("r1", 1.0), ("r2", 2.0)):
        study_tables.write(store, cell(run_id=run_id), made(store, survived))
        study_tables.note(store, cell(run_id=run_id), {"run_id": run_id})
    rows = study_tables.query(store, "SELECT run_id, survived_s FROM evaluations")
    assert rows == [{"run_id": "r2", "survived_s": 2.0}]
    assert study_tables.query(store, "SELECT run_id FROM runs") == [{"run_id": "r2"}]


@pytest.mark.medium
def test_writers_of_different_cells_lose_nothing(store: Store) -> None:
    given = made(store)
    with ThreadPoolExecutor(8) as pool:
        list(pool.map(lambda n: study_tables.write(store, cell(n, f"r{n}"), given), range(24)))
    assert study_tables.query(store, "SELECT count(*) AS n FROM episodes") == [{"n": 24}]


def test_provenance_is_a_table_beside_the_rows(store: Store) -> None:
    study_tables.note(store, cell(), {"run_id": "r1", "git_commit": "abc", "config": {"steps": 5}})
    study_tables.write(store, cell(), made(store))
    sql = "SELECT git_commit FROM runs JOIN evaluations USING (run_id)"
    assert study_tables.query(store, sql) == [{"git_commit": "abc"}]


@pytest.mark.parametrize(
    ("success", "survived_s", "statue", "known"),
    [
        (1.0, 0.5, 0.0, None),  # half a second says nothing
        (1.0, 10.0, 0.6, None),  # a statue does as well
        (1.0, 10.0, 0.0, 1.0),
        (0.0, 0.5, 0.0, 0.0),  # fell
    ],
)
def test_a_line_a_cell_evaluates_nothing_that_is_too_short(
    success: float, survived_s: float, statue: float, known: float | None, store: Store
) -> None:
    same = {**NAMES, "phase": 0, "reset": 0, "clip_fraction": 1.0, "fell": success == 0}
    own = {"policy": "trained", "success": success, "strict_success": success, "skill": success}
    rows = [
        {**same, **own, "survived_s": survived_s},
        {**same, **own, "policy": "statue", "strict_success": statue, "survived_s": survived_s},
        *({**same, **own, "policy": name, "survived_s": survived_s} for name in VARIANTS),
    ]
    encoded = tables.encode_rows(EVALUATION_RECORD, rows)
    kept = {"evaluations": store.save("stage", "evaluations.parquet", encoded)}
    study_tables.write(store, cell(), {**made(store), **kept})
    (row,) = study_tables.query(store, OVERVIEW)
    assert (row["strict_success"], row["skill"], row["rollouts"]) == (known, known, 1)


def test_beats_of_a_dance_are_a_table_of_their_own(store: Store) -> None:
    figures = {"beats": 4, "precision": 0.5, "recall": 1.0, "f1": 2 / 3, "bas": 0.9}
    rows = [{"robot": "humanoid", "motion": name, **figures} for name in ("robot", "control")]
    place = study_tables.Place(study_tables.DANCES, "walk", "scratch", 0, "r1")
    first = study_tables.write_beats(store, place, rows)
    assert study_tables.write_beats(store, place, rows) == first
    study_tables.write(store, cell(), made(store))
    sql = "SELECT run_id, motion, precision, f1 FROM beats ORDER BY motion DESC"
    assert study_tables.query(store, sql)[0] == {
        "run_id": "r1", "motion": "robot", "precision": 0.5, "f1": 2 / 3,
    }  # fmt: skip
    assert [row["study"] for row in study_tables.query(store, OVERVIEW)] == ["smoke"]


@pytest.mark.parametrize(
    ("sql", "expected"),
    [
        ("SELECT count(*) AS n FROM Episodes", 1),
        ("SELECT count(*) AS n FROM query_table('epi' || 'sodes')", 1),
        ("SELECT count(*) AS n FROM information_schema.tables", 4),
    ],
)
def test_a_question_reads_the_tables_that_it_names(sql: str, expected: int, store: Store) -> None:
    study_tables.write(store, cell(), made(store))
    store.put(cell(run_id="damaged").key("evaluations"), b"no table")
    if "query_table" in sql:
        store.remove(cell(run_id="damaged").key("evaluations"))
    assert study_tables.query(store, sql) == [{"n": expected}]


def test_the_joined_file_of_a_finished_study_is_read_as_its_cells(
    store: Store, tmp_path: Path
) -> None:
    """As docs/scaling.md joins them, night after night; a cell that is published again counts
    once."""
    for seed in range(3):
        study_tables.write(store, cell(seed, f"r{seed}"), made(store, seed))
    page = (Path(__file__).parents[2] / "docs" / "scaling.md").read_text()
    script = page.split("```python\n")[1].split("```")[0]
    folder = tmp_path / "metrics" / "evaluations" / "study=smoke"
    for expected in (3.0, 3.0, 3.0):
        subprocess.run([sys.executable, "-c", script, folder], check=True)
        assert len(store.list("metrics/evaluations")) == 1
        sql = "SELECT sum(survived_s) AS s FROM evaluations"
        assert study_tables.query(store, sql) == [{"s": expected}]
        assert study_tables.read(store, "evaluations", "smoke", {"r1"}).num_rows == 1
        study_tables.write(store, cell(1, "r1"), made(store, 1))


def test_an_empty_store_answers_with_no_rows(store: Store) -> None:
    assert study_tables.query(store, OVERVIEW) == []


def test_a_question_cannot_read_other_files(store: Store, tmp_path: Path) -> None:
    (tmp_path / "secret.csv").write_text("a\n1\n")
    with pytest.raises(BadTable, match="metrics"):
        study_tables.query(store, f"SELECT * FROM '{tmp_path}/secret.csv'")


def test_a_question_that_is_no_sql_is_one_line(store: Store) -> None:
    with pytest.raises(BadTable) as caught:
        study_tables.query(store, "SELEC")
    assert "\n" not in str(caught.value)


def test_a_table_that_is_not_one_is_refused_before_anything_is_written(store: Store) -> None:
    given: dict[str, Any] = {**made(store), "episodes": store.put("x.parquet", b"no table")}
    with pytest.raises(BadTable):
        study_tables.write(store, cell(), given)
    assert not store.list(study_tables.FOLDER)
