"""The arguments of `find`, before anything is searched."""

import json
from dataclasses import asdict, replace
from datetime import UTC, datetime
from pathlib import Path

import pytest

from configs.dance_book import Dance, DanceBook
from configs.find_config import FindConfig
from flows.search import requests
from flows.search.requests import (
    ALL,
    check_refresh,
    find_dance,
    require_findable,
    require_online,
)
from robojackson.clips.sources import urls
from robojackson.errors import BadConfiguration, SearchFailed
from robojackson.pipeline.yaml_loader import load
from storage import candidate_catalogue
from storage.store import Store
from tasks.download_video import WebVideo
from tests.fixtures.commands import LOADED, in_process, robojackson

NOW = datetime(2026, 11, 21, tzinfo=UTC)


def test_a_list_of_addresses_needs_no_query(tmp_path: Path) -> None:
    (tmp_path / "list.txt").write_text("https://example.org/a.mp4\n")
    listed = str(tmp_path / "list.txt")
    dance = find_dance("", "urls", listed, None, FindConfig())
    assert (dance.name, dance.full_query, dance.address) == ("urls", "", listed)


def test_a_query_that_the_book_knows_is_that_dance() -> None:
    assert find_dance("apt", "youtube", "", None, FindConfig()).full_query.startswith("APT dance")


@pytest.mark.parametrize("words", ["my clips", "clips"])
@pytest.mark.parametrize(("top", "expected"), [(None, 3), (2, 2)])
def test_a_dance_of_the_book_is_looked_for_where_the_book_says(
    words: str, top: int | None, expected: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "a.mp4").write_text("")
    named = Dance("My Clips", "clips", top=3, source="folder", address=str(tmp_path))
    monkeypatch.setattr(requests, "load", lambda *_: DanceBook((named,)))
    assert find_dance(words, None, "", top, FindConfig()) == replace(named, top=expected)


def test_a_dance_of_the_book_may_have_an_address_and_no_words(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "a.mp4").write_text("")
    named = Dance("mine", "", source="folder", address=str(tmp_path))
    monkeypatch.setattr(requests, "load", lambda *_: DanceBook((named,)))
    assert find_dance("mine", None, "", None, FindConfig()) == named
    with pytest.raises(BadConfiguration, match="the query is empty"):
        find_dance(" ", None, "", None, FindConfig())


@pytest.mark.parametrize(("top", "expected"), [(None, ALL), (2, 2)])
def test_a_folder_is_assessed_whole_unless_a_number_is_given(top, expected, tmp_path: Path) -> None:
    (tmp_path / "a.mp4").write_text("")
    assert find_dance(str(tmp_path), "folder", "", top, FindConfig()).top == expected


def offline(page: str, proxy: str | None) -> None:
    raise SearchFailed(f"no connection to {page}")


def test_without_a_network_a_folder_can_still_be_searched(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(requests, "require_reachable", offline)
    (tmp_path / "a.mp4").write_text("")
    require_online(find_dance(str(tmp_path), "folder", "", None, FindConfig()), FindConfig())


def test_without_a_network_a_name_is_refused_unless_it_was_found_before(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(requests, "require_reachable", offline)
    store = Store(tmp_path)
    with pytest.raises(SearchFailed, match=r"no connection to https://www\.youtube\.com"):
        require_findable("apt", store)
    monkeypatch.setattr(candidate_catalogue, "champion", lambda *_: {"video_key": "video/a.mp4"})
    require_findable("apt", store)


def test_of_an_address_its_own_site_has_to_answer(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(requests, "require_reachable", offline)
    with pytest.raises(SearchFailed, match="no connection to https://host/clip"):
        require_findable(" https://host/clip ", Store(tmp_path))


def test_a_video_that_was_downloaded_before_needs_no_network(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    address = "https://host/clip.mp4"
    monkeypatch.setattr(requests, "require_reachable", offline)
    store, (found,) = Store(tmp_path), urls.search("", address, 1, FindConfig().web, NOW)
    kept = store.save("video", "clip.mp4", b"of the first dance")
    store.put(f"{WebVideo.of(found).folder}/only.mp4.json", json.dumps(asdict(kept)).encode())
    require_findable(address, store)
    assert f"{address} cannot be reached: its stored video is used" in caplog.text
    with pytest.raises(SearchFailed, match="no connection to https://host/other"):
        require_findable("https://host/other.mp4", store)
    (tmp_path / kept.key).unlink()
    with pytest.raises(SearchFailed, match="no connection to https://host/clip"):
        require_findable(address, store)


def test_a_missing_cookie_file_is_reported_before_the_search(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A folder needs no cookies."""
    monkeypatch.setattr(requests, "require_reachable", lambda page, proxy: None)
    absent = {"web.cookies_file": str(tmp_path / "absent.txt")}
    settings = load(FindConfig, "finding", absent)
    monkeypatch.setattr(requests, "load", lambda cls, *_: settings if cls is FindConfig else None)
    with pytest.raises(BadConfiguration, match=r"web\.cookies_file: .*absent\.txt: no such file"):
        require_online(find_dance("apt", "site", "https://host/", None, settings), settings)
    with pytest.raises(BadConfiguration, match="no such file"):
        require_findable("https://host/clip.mp4", Store(tmp_path))
    with pytest.raises(BadConfiguration, match="no such file"):
        check_refresh(None, "finding", absent, None)
    (tmp_path / "a.mp4").write_text("")
    require_online(find_dance(str(tmp_path), "folder", "", None, settings), settings)


@pytest.mark.medium
def test_the_address_that_find_advises_is_a_source_of_dance(tmp_path: Path) -> None:
    text = in_process("dance", "http://127.0.0.1:9/watch?v=x", ROBOJACKSON_STORE=str(tmp_path))
    assert text.code == 1
    assert "SearchFailed: no connection to 127.0.0.1" in text.err


@pytest.mark.medium
def test_find_without_a_network_is_one_line_and_starts_no_prefect(tmp_path: Path) -> None:
    where = ("--source", "server", "--address", "http://127.0.0.1:9/")
    text = robojackson("find", "apt", *where, ROBOJACKSON_STORE=str(tmp_path))
    assert text.code == 1
    assert not text.loaded_prefect
    assert [line for line in text.err.splitlines() if "SearchFailed" in line] == [
        line for line in text.err.splitlines() if line and not line.startswith(LOADED)
    ]
    assert not list(tmp_path.iterdir())
