"""Five minutes of polish beside the full time: paired by seed, and only where both have a row."""

from pathlib import Path

import pytest

from benchmarks.learning.policies import ROOT, Folders
from benchmarks.learning.rows import polish_rows
from benchmarks.learning.rows.g1_rows_table import DOCUMENT, written_between
from tests.fixtures.row_rollouts import rollouts

MOVE = "g1_hip_shake"


@pytest.fixture
def folders(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Folders:
    """Return rows of seeds 100 and 101 of both budgets, and one of seed 102 without its partner."""
    folders = Folders.at(tmp_path)
    shares = {(100, 5.0): 0.8, (100, None): 0.9, (101, 5.0): 1.0, (101, None): 0.9, (102, 5.0): 0.0}
    rows = {
        folders.row(MOVE, seed, 10.0, minutes): share for (seed, minutes), share in shares.items()
    }
    folders.rows.mkdir(parents=True)
    for path in rows:
        path.touch()
    monkeypatch.setattr(polish_rows, "read_rows", lambda path: rollouts(rows[path], 1.0))
    return folders


def test_differences_are_of_seeds_that_have_both_rows(folders: Folders) -> None:
    (row,) = polish_rows.polish_rows(folders)
    assert row["seeds"] == [100, 101]
    assert row["strict_success"] == pytest.approx(0.9)
    assert row["worst_seed"] == pytest.approx(0.8)
    middle, low, high = row["difference"]["strict_success"]
    assert middle == pytest.approx(0.0)
    assert (low, high) == pytest.approx((-0.1, 0.1))


def test_bars_are_those_of_the_full_time(folders: Folders) -> None:
    (row,) = polish_rows.polish_rows(folders)
    assert not row["bars"]["strict success >= 0.99"]


def test_the_document_has_the_table_of_the_kept_rows() -> None:
    text = DOCUMENT.read_text(encoding="utf-8")
    rows = polish_rows.polish_rows(Folders(ROOT, ROOT / "benchmarks" / "results"))
    assert [row["move"] for row in rows] == list(polish_rows.POLISHED)
    table = polish_rows.polish_table(rows)
    assert written_between(text, polish_rows.BEGIN, polish_rows.END, table) == text
