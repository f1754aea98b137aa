"""`robojackson clean`: a dry run by itself."""

from pathlib import Path

import pytest

from storage import store_cleaning
from storage.store import Store
from tests.fixtures.commands import Said, in_process


@pytest.fixture
def store(tmp_path: Path) -> Store:
    made = Store(tmp_path / "store").create()
    made.save("mocap", "smpl.parquet", bytes(2_000_000))
    return made


def clean(store: Store, *words: str) -> Said:
    return in_process("clean", *words, ROBOJACKSON_STORE=store.root)


def test_it_lists_what_would_go_and_removes_nothing(store: Store) -> None:
    result = clean(store, "--older-than", "0")
    assert result.code == 0
    assert "Would go: 1 item, 2.0 MB. Nothing was removed." in result.out
    assert "next: robojackson " in result.out
    assert len(store.list()) == 1


@pytest.mark.parametrize("word", ["--delete", "--yes"])
def test_it_removes_when_it_should(word: str, store: Store) -> None:
    result = clean(store, "--older-than", "0", word)
    assert result.out.splitlines()[-1] == "Removed: 1 item, 2.0 MB."
    assert store.list() == []


def test_what_cannot_be_removed_is_named_and_fails(
    store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(store_cleaning, "_remove", lambda *given: "Permission denied")
    result = clean(store, "--older-than", "0", "--delete")
    assert result.code == 1
    assert "could not be removed: mocap/" in result.out
    assert result.out.splitlines()[-1] == "Removed: 0 items, 0.0 MB."
    answer = clean(store, "--older-than", "0", "--delete", "--json").answer
    assert list(answer["failed"].values()) == ["Permission denied"]


def test_what_is_young_stays_by_itself(store: Store) -> None:
    assert (
        "Nothing would go: of these kinds, nothing that may go is 30 days old" in clean(store).out
    )
    assert "Nothing was removed: of these kinds" in clean(store, "--delete").out
    assert clean(store, "--json", "--delete").answer["items"] == []
    assert len(store.list()) == 1


def test_the_answer_says_how_big_and_how_old_each_kind_is(store: Store) -> None:
    answer = clean(store, "--json", "--older-than", "0").answer
    assert answer["kinds"]["unused"]["size_mb"] == answer["size_mb"] == 2.0
    assert answer["kinds"]["unused"]["oldest_days"] < 1
    assert answer["removed"] is False


def test_a_kind_that_is_none_is_a_usage_error(store: Store) -> None:
    assert clean(store, "--kind", "tables").code == 2
