"""Which reference motion a row of the table of policies stands on, and how the table shows it."""

import json
from pathlib import Path

import pytest

from benchmarks.learning import training_rows
from benchmarks.learning.policies import FROZEN, Folders
from benchmarks.learning.rows.g1_rows_table import (
    BEGIN,
    DOCUMENT,
    END,
    g1_rows_table,
    written_between,
)
from benchmarks.learning.rows.row_references import record_reference, recorded, standing
from benchmarks.learning.split import load_split

HERE = Folders.at(None)
WALK = load_split().references["g1_walk"]


def rows_of(folders: Folders, *seeds: int) -> list[Path]:
    folders.rows.mkdir(parents=True, exist_ok=True)
    return [folders.row("g1_walk_onboard", seed, 10.0) for seed in seeds]


def test_a_row_records_the_poses_that_it_was_made_on(tmp_path: Path) -> None:
    folders = Folders.at(tmp_path)
    first, second = rows_of(folders, 100, 101)
    record_reference(first, FROZEN / "g1_walk.parquet", folders)
    record_reference(second, FROZEN / "g1_hip_shake.parquet", folders)
    assert recorded(folders)["g1_walk_onboard-s100"] == WALK
    assert standing("g1_walk_onboard", [first], folders) == {
        "reference": "frozen",
        "stale_seeds": [],
    }
    assert standing("g1_walk_onboard", [first, second], folders) == {
        "reference": "older",
        "stale_seeds": [101],
    }


def test_a_row_without_a_record_is_not_called_frozen(tmp_path: Path) -> None:
    folders = Folders.at(tmp_path)
    found = standing("g1_walk_onboard", rows_of(folders, 100), folders)
    assert found == {"reference": "not recorded", "stale_seeds": []}


def test_both_horizons_of_a_seed_have_one_reference(tmp_path: Path) -> None:
    folders = Folders.at(tmp_path)
    rows_of(folders)
    record_reference(folders.row("g1_walk", 3, 20.0), FROZEN / "g1_walk.parquet", folders)
    assert list(recorded(folders)) == ["g1_walk-s3"]


def test_a_training_records_its_reference(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    folders = Folders.at(tmp_path)
    work = folders.work / "g1_walk"
    work.mkdir(parents=True)
    (work / "reference.parquet").write_bytes((FROZEN / "g1_walk.parquet").read_bytes())

    def write(*words: object, core: int | None = None) -> None:
        if words[0] == "evaluate":
            out = Path(str(words[words.index("-o") + 1]))
            out.mkdir(parents=True)
            (out / "evaluations.parquet").write_bytes(b"rows")

    monkeypatch.setattr(training_rows, "must", write)
    training_rows.train_and_judge("g1_walk", 7, None, folders, 0)
    assert recorded(folders) == {"g1_walk-s7": WALK}
    assert folders.row("g1_walk", 7, 20.0).read_bytes() == b"rows"


def test_no_row_of_the_repository_stands_on_an_older_reference() -> None:
    rows = json.loads((HERE.results / "learning.json").read_text())["rows"]
    assert [row["move"] for row in rows if row["reference"] == "older"] == []


def test_every_recorded_row_exists() -> None:
    names = {path.stem.removesuffix("-20s") for path in HERE.rows.glob("*.parquet")}
    assert set(recorded(HERE)) <= names


def test_the_document_has_the_table_of_the_results() -> None:
    rows = json.loads((HERE.results / "learning.json").read_text())["rows"]
    text = DOCUMENT.read_text(encoding="utf-8")
    assert written_between(text, BEGIN, END, g1_rows_table(rows)) == text


def test_a_missed_bar_is_marked_beside_its_figure() -> None:
    rows = json.loads((HERE.results / "learning.json").read_text())["rows"]
    apt1 = [row for row in rows if row["move"] == "g1_authors_apt1_onboard"]
    line = g1_rows_table(apt1).splitlines()[-1]
    assert "| 1.90 ✗ | 0.80 ✗, " in line
    assert line.count("✗") == 2


def test_only_what_lies_between_the_comments_is_replaced() -> None:
    found = written_between(f"a {BEGIN}old{END} b", BEGIN, END, g1_rows_table([]))
    assert found.split(BEGIN)[0] == "a "
    assert found.endswith(f"{END} b")
