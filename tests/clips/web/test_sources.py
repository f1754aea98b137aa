"""Folders and lists as sources; the web ones are tested against a server."""

from datetime import UTC, datetime
from pathlib import Path

import pytest

from robojackson.clips.sources import names, source
from robojackson.clips.web.yt_dlp_client import WebConfig
from robojackson.errors import SearchFailed, UnknownName

NOW = datetime(2026, 11, 21, tzinfo=UTC)
WEB = WebConfig()


def test_a_source_is_a_file() -> None:
    assert names() == ("folder", "server", "site", "urls", "youtube")


def test_an_unknown_source_is_refused_with_the_known_ones() -> None:
    with pytest.raises(UnknownName, match="folder, server, site, urls, youtube"):
        source("myspace")


def test_a_folder_offers_its_videos_by_name(tmp_path: Path) -> None:
    for name in ("b.mp4", "a.MOV", "notes.txt", "\x1b[31m.webm"):
        (tmp_path / name).write_bytes(b"")
    found = source("folder").search(str(tmp_path), "", 10, WEB, NOW)
    assert [candidate.title for candidate in found] == ["[31m.webm", "a.MOV", "b.mp4"]


def test_a_name_in_two_folders_is_two_videos(tmp_path: Path) -> None:
    keys = set()
    for folder in ("one", "two"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "clip.mp4").write_bytes(b"")
        keys |= {c.key for c in source("folder").search("", str(tmp_path / folder), 9, WEB, NOW)}
    assert len(keys) == 2


def test_a_file_that_is_replaced_is_another_video(tmp_path: Path) -> None:
    keys = set()
    for content in (b"first", b"again", b"again"):
        (tmp_path / "practice.mp4").write_bytes(content)
        keys |= {c.key for c in source("folder").search("", str(tmp_path), 9, WEB, NOW)}
    assert len(keys) == 2


def test_a_folder_that_is_not_there_is_a_failed_search(tmp_path: Path) -> None:
    with pytest.raises(SearchFailed, match="no such file or folder"):
        source("folder").search(str(tmp_path / "gone"), "", 10, WEB, NOW)


def test_a_list_has_comments_and_names_with_spaces(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    path = tmp_path / "urls.txt"
    lines = "  # mine\n\t#\nhttp://host/my dance.mp4\t# the best\nhttp://host/p#part\n"
    path.write_text(lines)
    found = source("urls").search("", str(path), 10, WEB, NOW)
    assert [c.url for c in found] == ["http://host/my%20dance.mp4", "http://host/p#part"]
    assert not caplog.records


def test_a_list_leaves_out_comments_and_what_is_no_address(tmp_path: Path) -> None:
    path = tmp_path / "urls.txt"
    path.write_text("# mine\nhttps://host/a.mp4\n\nfile:///etc/passwd\n  http://host/b?x=1  \n")
    found = source("urls").search("apt", str(path), 10, WEB, NOW)
    assert [c.url for c in found] == ["https://host/a.mp4", "http://host/b?x=1"]
    assert {c.query for c in found} == {"apt"}


def test_addresses_may_be_given_in_a_line() -> None:
    found = source("urls").search("https://host/a.mp4 https://host/b.mp4", "", 10, WEB, NOW)
    assert [candidate.title for candidate in found] == ["a.mp4", "b.mp4"]


def test_a_list_is_read_to_its_end_and_its_rows_can_be_told_apart() -> None:
    lines = " ".join(f"https://www.youtube.com/watch?v=AAAAAAAAA{number}" for number in range(60))
    found = source("urls").search(lines, "", 40, WEB, NOW)
    assert len({candidate.key for candidate in found}) == 60
    assert found[7].title == "watch?v=AAAAAAAAA7"


def test_a_list_without_addresses_is_a_failed_search(tmp_path: Path) -> None:
    (tmp_path / "urls.txt").write_text("nothing\n")
    with pytest.raises(SearchFailed, match="holds no address"):
        source("urls").search("", str(tmp_path / "urls.txt"), 10, WEB, NOW)


def test_a_site_needs_an_address() -> None:
    with pytest.raises(SearchFailed, match="no address"):
        source("site").search("apt", "", 10, WEB, NOW)
