"""The line of `catalogue` before any video is assessed."""

from datetime import UTC, datetime
from pathlib import Path

import pytest

from storage import candidate_catalogue
from storage.store import Store
from tests.fixtures.commands import in_process


def test_an_empty_catalogue_says_what_fills_it(tmp_path: Path) -> None:
    text = in_process("catalogue", ROBOJACKSON_STORE=str(tmp_path / "store"))
    assert text.code == 0, text.err
    assert "robojackson find DANCE" in text.out
    assert "--source folder" in text.out


def test_a_dance_that_was_never_assessed_says_how_to_look_for_it(tmp_path: Path) -> None:
    text = in_process("catalogue", "--dance", "it's", ROBOJACKSON_STORE=str(tmp_path / "store"))
    assert "robojackson find 'it'" in text.out


def test_an_empty_catalogue_is_an_empty_list_for_programs(tmp_path: Path) -> None:
    text = in_process("catalogue", "--json", ROBOJACKSON_STORE=str(tmp_path / "store"))
    assert text.answer == {"candidates": []}


def test_the_query_of_a_dance_of_the_book_finds_its_rows(tmp_path: Path) -> None:
    """`find "APT dance"` records them under the name, APT."""
    when = datetime(2026, 12, 1, tzinfo=UTC)
    row = {"run_id": "r", "dance": "APT", "source": "youtube", "video_id": "v", "title": "one"}
    row |= {"url": "https://host/v", "retrieved_at": when, "decided_at": when}
    candidate_catalogue.append(Store(tmp_path), [{**row, "decision": "accepted"}])
    words = ("catalogue", "--dance", "APT dance", "--json")
    found = in_process(*words, ROBOJACKSON_STORE=str(tmp_path)).answer["candidates"]
    assert [each["video_id"] for each in found] == ["v"]


def test_a_dance_and_a_question_are_refused_together(tmp_path: Path) -> None:
    words = ("catalogue", "--dance", "APT", "--sql", "SELECT 1 AS one")
    text = in_process(*words, ROBOJACKSON_STORE=str(tmp_path / "store"))
    assert (text.code, text.out) != (0, "1\n")
    assert "--dance and --sql: give one" in text.err


@pytest.mark.parametrize("command", ["catalogue", "metrics"])
def test_a_question_without_an_answer_says_so_and_no_more(command: str, tmp_path: Path) -> None:
    sql = "SELECT 1 AS one WHERE false"
    text = in_process(command, "--sql", sql, ROBOJACKSON_STORE=str(tmp_path / "store"))
    assert (text.code, text.out) == (0, "no rows\n")
