"""A run is written down and read again, whatever the video was called."""

from datetime import UTC, datetime
from pathlib import Path

import pytest

from robojackson.pipeline.run_names import NAME_LENGTH, run_name, slug_of
from storage import run_catalogue
from storage.run_catalogue import Run
from storage.store import Store

ODD = [
    "my dance (1)",
    "a & b+c",
    'it\'s "it"',
    "ダンス",
    "café",
    "춤 1",
    "로" * 70 + "x" * 70,
    "-rm",
    "x" * 300,
    "...",
    "",
    "a/b",
]


@pytest.mark.parametrize("name", ODD)
def test_a_run_of_an_oddly_named_video_is_in_the_catalogue(name: str, tmp_path: Path) -> None:
    store, run_id = Store(tmp_path), f"{run_name(name)}-scratch-s0"
    when = datetime(2026, 1, 1, tzinfo=UTC)
    run_catalogue.record(store, Run(run_id, name, "humanoid", "scratch", 0, when))
    assert [(run.run_id, run.move) for run in run_catalogue.list_runs(store)] == [(run_id, name)]


@pytest.mark.parametrize("name", ODD)
def test_a_safe_name_is_no_option_no_path_and_not_long(name: str) -> None:
    made = run_name(name)
    assert 0 < len(made) <= NAME_LENGTH
    assert made[0].isalnum()
    assert "/" not in made


def test_a_plain_name_stays_as_it_is() -> None:
    assert run_name("hip_shake.v2-final") == "hip_shake.v2-final"


@pytest.mark.parametrize(
    ("one", "other"),
    [("ダンス", "舞踊"), ("춤 1", "舞 1"), ("APT 로제", "APT 제니"), ("x" * 300 + "ダ", "x" * 300)],
)
def test_two_names_that_lose_letters_stay_two(one: str, other: str) -> None:
    assert run_name(one) != run_name(other)
    assert slug_of(one) != slug_of(other)


@pytest.mark.parametrize(
    ("name", "made"), [("café", "cafe"), ("APT – live! 🔥", "APT-live"), ("Ａ１", "A1")]
)
def test_a_name_that_loses_no_letter_has_no_digest(name: str, made: str) -> None:
    assert run_name(name) == made
