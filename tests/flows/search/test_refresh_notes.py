"""When a dance is due again: by the beginning of the refresh before, for each robot by itself."""

import json
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from configs.dance_book import Dance
from flows.search.refresh_notes import is_due, note
from robojackson.pipeline.pipeline_config import PipelineConfig
from storage.store import Store

DANCE, USUAL = Dance(name="APT", query="apt"), PipelineConfig().robot
NIGHT = datetime.now(UTC) - timedelta(hours=9)
"""A refresh that ends nine hours after its beginning."""


@pytest.fixture
def store(tmp_path: Path) -> Store:
    store = Store(tmp_path)
    note(store, DANCE, USUAL, NIGHT, {"reference": "r"})
    return store


def test_the_next_night_has_it_however_long_the_last_one_took(store: Store) -> None:
    assert is_due(store, DANCE, USUAL, NIGHT + timedelta(days=1))
    assert not is_due(store, DANCE, USUAL, NIGHT + timedelta(hours=12))


def test_it_is_due_for_a_robot_for_which_it_was_not_refreshed(store: Store) -> None:
    assert is_due(store, DANCE, "g1", NIGHT)
    note(store, DANCE, "g1", NIGHT, {})
    assert not is_due(store, DANCE, "g1", NIGHT)


def test_a_note_without_a_beginning_counts_by_its_end(store: Store) -> None:
    facts = {"finished_at": NIGHT.isoformat(), "dance": DANCE.name}
    store.put("refresh/apt.json", json.dumps(facts).encode())
    assert not is_due(store, DANCE, USUAL, NIGHT + timedelta(hours=12))
    assert is_due(store, DANCE, USUAL, NIGHT + timedelta(hours=22))


@pytest.mark.parametrize(
    "text", ["", "[]", "{}", '{"started_at": "x"}', '{"started_at": "2999-01-01"}']
)
def test_a_dance_whose_note_is_damaged_is_due(
    text: str, store: Store, caplog: pytest.LogCaptureFixture
) -> None:
    store.put("refresh/apt.json", text.encode())
    assert is_due(store, DANCE, USUAL, NIGHT)
    assert "apt.json cannot be read" in caplog.text
