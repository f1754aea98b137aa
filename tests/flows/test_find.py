"""`find` and `catalogue` from the command line, on two clips."""

import shutil
from pathlib import Path

import pytest

from flows.search.dance_source import is_name, is_on_the_web
from tests.fixtures.commands import Said, in_process, robojackson
from tests.fixtures.difficult_clips import black, write

pytestmark = pytest.mark.xdist_group("find")


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("found") / "store"


@pytest.fixture(scope="module")
def found(short_clip: Path, store: Path) -> Said:
    folder = store.parent / "clips"
    folder.mkdir()
    shutil.copy(short_clip, folder / "hips.mp4")
    write(folder / "night.mp4", list(black())[:35])
    (folder / "words.mp4").write_text("no video")
    return robojackson("find", folder, "--source", "folder", "--json", ROBOJACKSON_STORE=str(store))


@pytest.mark.medium
def test_find_answers_with_the_chosen_video(found: Said) -> None:
    assert found.code == 0, found.err
    assert found.answer["chosen"]["title"] == "hips.mp4"


@pytest.mark.medium
def test_find_gives_every_video_its_reason(found: Said) -> None:
    facts = {row["title"]: (row["decision"], row["reason"]) for row in found.answer["candidates"]}
    assert facts == {
        "hips.mp4": ("chosen", ""),
        "night.mp4": ("rejected", "no person found in 35 of 35 frames"),
        "words.mp4": ("failed", "not a video that FFmpeg can read"),
    }


@pytest.mark.medium
def test_the_catalogue_has_the_same_rows_and_needs_no_prefect(found: Said, store: Path) -> None:
    text = robojackson("catalogue", "--json", ROBOJACKSON_STORE=str(store))
    rows = text.answer["candidates"]
    assert {r["title"]: r["decision"] for r in rows} == {
        r["title"]: r["decision"] for r in found.answer["candidates"]
    }
    assert not text.loaded_prefect


@pytest.mark.medium
def test_the_catalogue_answers_sql(found: Said, store: Path) -> None:
    sql = "SELECT count(*) AS n FROM candidates WHERE decision = 'chosen'"
    text = in_process("catalogue", "--sql", sql, "--json", ROBOJACKSON_STORE=str(store))
    assert text.answer == {"rows": [{"n": 1}]}


@pytest.mark.medium
def test_an_unknown_source_is_one_line(store: Path) -> None:
    text = in_process("find", "x", "--source", "myspace", ROBOJACKSON_STORE=str(store))
    assert text.code == 1
    assert "unknown source 'myspace'" in text.err
    assert "youtube" in text.err


@pytest.mark.parametrize(
    ("source", "name"),
    [("APT dance", True), ("moonwalk", True), ("a.mp4", False), ("x/y", False), (None, False)],
)
def test_what_is_no_path_is_the_name_of_a_dance(source: str | None, name: bool) -> None:
    assert is_name(source) is name


@pytest.mark.parametrize(
    ("source", "web"),
    [("APT dance", True), ("https://host/v?id=1", True), ("a.mp4", False), ("x/y", False)],
)
def test_a_name_and_an_address_are_downloaded_and_a_path_is_not(source: str, web: bool) -> None:
    assert is_on_the_web(source) is web
