"""yt-dlp against a server of our own: every failure becomes a reason, and nothing comes twice."""

from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import pytest

from robojackson.clips.sources import source
from robojackson.clips.video import VideoLimits, probe
from robojackson.clips.web.download_formats import FormatConfig
from robojackson.clips.web.yt_dlp_client import WebConfig, fetch, listing, offer
from robojackson.errors import BadConfiguration, DownloadFailed, SearchFailed, TruncatedVideo
from tests.fixtures.web_server import PATIENT, Web

COOKIES = (
    b"# Netscape HTTP Cookie File\r\n# of a browser\r\n\r\n"
    b"127.0.0.1\tFALSE\t/\tFALSE\t0\tsession\topensesame\r\n"
)
NOW = datetime(2026, 11, 21, tzinfo=UTC)


def get(web: Web, path: str, folder: Path, config: WebConfig = PATIENT) -> Path:
    return fetch(offer(f"{web.url}/{path}", "score", FormatConfig(), config), folder, config)


@pytest.mark.medium
@pytest.mark.parametrize("path", ["good/clip.mp4", "moved/clip.mp4", "busy_once/clip.mp4"])
def test_a_video_arrives_as_it_was_sent(web: Web, path: str, tmp_path: Path) -> None:
    assert get(web, path, tmp_path).read_bytes() == web.video


@pytest.mark.medium
@pytest.mark.parametrize(
    ("path", "reason"),
    [
        ("missing/clip.mp4", "HTTP 404 not found"),
        ("busy/clip.mp4", r"HTTP 429 too many requests \(3 attempts\)"),
        ("broken/clip.mp4", r"HTTP 503 .*\(3 attempts\)"),
        ("stall/clip.mp4", r"the server fell silent \(3 attempts\)"),
        ("half/clip.mp4", r"cut the file short \(3 attempts\)"),
        ("circle/clip.mp4", "HTTP 302 redirects without end"),
    ],
)
def test_a_failure_of_the_server_is_a_reason(
    web: Web, path: str, reason: str, tmp_path: Path
) -> None:
    with pytest.raises(DownloadFailed, match=reason):
        get(web, path, tmp_path)


def test_what_cannot_come_right_is_requested_once(web: Web, tmp_path: Path) -> None:
    with pytest.raises(DownloadFailed):
        get(web, "missing/clip.mp4", tmp_path)
    assert web.times("/missing/clip.mp4") == 1


def test_no_server_at_all_is_a_reason(tmp_path: Path) -> None:
    with pytest.raises(DownloadFailed, match="no connection"):
        offer("http://127.0.0.1:9/clip.mp4", "score", FormatConfig(), PATIENT)


def test_a_download_that_was_cut_goes_on_where_it_stopped(web: Web, tmp_path: Path) -> None:
    path = get(web, "half_once/clip.mp4", tmp_path)
    starts = [int(r.strip("bytes=-")) for _, r in web.requests if r]
    assert path.read_bytes() == web.video
    assert len(starts) == 1
    assert 0 < starts[0] <= len(web.video) // 2


def test_a_download_that_was_given_up_goes_on_the_next_day(web: Web, tmp_path: Path) -> None:
    once = WebConfig(private_addresses=True, retries=0, timeout_s=1.0, request_pause_s=0.0)
    with pytest.raises(DownloadFailed):
        get(web, "half_once/clip.mp4", tmp_path, once)
    sizes = [path.stat().st_size for path in tmp_path.iterdir()]
    assert len(sizes) == 1
    assert 0 < sizes[0] <= len(web.video) // 2
    assert get(web, "half_once/clip.mp4", tmp_path, once).read_bytes() == web.video


def test_a_file_that_ends_where_the_server_says_is_found_out_by_its_index(
    web: Web, tmp_path: Path
) -> None:
    path = get(web, "wrong_length/clip.mp4", tmp_path)
    with pytest.raises(TruncatedVideo):
        probe(path, VideoLimits())


def test_a_file_beyond_the_limit_is_not_downloaded(web: Web, tmp_path: Path) -> None:
    with pytest.raises(DownloadFailed, match="larger than 300 MB"):
        get(web, "endless/clip.mp4", tmp_path)


@pytest.mark.medium
def test_the_rate_limit_is_kept(web: Web, tmp_path: Path) -> None:
    import time

    rate = len(web.video) / 0.8
    slow = WebConfig(
        private_addresses=True, retries=0, request_pause_s=0.0, rate_limit_bytes_s=rate
    )
    chosen = offer(f"{web.url}/good/clip.mp4", "score", FormatConfig(), slow)
    began = time.monotonic()
    fetch(chosen, tmp_path, slow)
    assert time.monotonic() - began > 0.4


def test_progress_ends_with_the_whole_file(web: Web, tmp_path: Path) -> None:
    calls: list[tuple[int, int | None]] = []
    chosen = offer(f"{web.url}/good/clip.mp4", "score", FormatConfig(), PATIENT)
    fetch(chosen, tmp_path, PATIENT, lambda done, total: calls.append((done, total)))
    assert calls[-1] == (len(web.video), len(web.video))


@pytest.mark.parametrize("mode", [0o600, 0o400])
def test_cookies_are_passed_through(web: Web, mode: int, tmp_path: Path) -> None:
    """Page, file and their second attempts all get the cookie; the user's file stays as it was."""
    jar = tmp_path / "cookies.txt"
    jar.write_bytes(COOKIES)
    jar.chmod(mode)
    config = replace(PATIENT, cookies_file=jar)
    web.faults = ["broken"]
    chosen = offer(f"{web.url}/good/clip.mp4", "score", FormatConfig(), config)
    web.faults = ["broken"]
    fetch(chosen, tmp_path, config)
    assert web.cookies == ["session=opensesame"] * 4
    assert jar.read_bytes() == COOKIES
    assert jar.stat().st_mode & 0o777 == mode


@pytest.mark.parametrize(
    ("name", "content", "reason"),
    [
        ("missing.txt", None, "no such file"),
        ("", None, "a folder, not a file"),
        ("picture.txt", b"\xff\xd8\xff", "no text in UTF-8"),
        ("cookies.json", b'[{"name": "session"}]', "its first line is not '# Netscape"),
    ],
)
def test_a_cookie_file_that_cannot_be_used_is_a_plain_line(
    web: Web, name: str, content: bytes | None, reason: str, tmp_path: Path
) -> None:
    path = tmp_path / name
    if content is not None:
        path.write_bytes(content)
    config = replace(PATIENT, cookies_file=path)
    with pytest.raises(BadConfiguration, match=reason) as failure:
        offer(f"{web.url}/good/clip.mp4", "score", FormatConfig(), config)
    with pytest.raises(BadConfiguration, match=reason):
        listing(f"{web.url}/files/", config)
    assert str(failure.value).startswith(f"web.cookies_file: {path}: ")
    assert failure.value.key == "web.cookies_file"
    assert not web.requests
    assert path.exists() == (name != "missing.txt")


def test_a_proxy_is_passed_through(web: Web) -> None:
    """With our server as the proxy, it gets the whole address."""
    config = WebConfig(retries=0, proxy=web.url, request_pause_s=0.0)
    with pytest.raises(DownloadFailed):
        offer("http://nowhere.invalid/clip.mp4", "score", FormatConfig(), config)
    assert web.times("http://nowhere.invalid/clip.mp4") == 1


def test_the_id_of_a_path_stays_in_the_folder(web: Web, tmp_path: Path) -> None:
    path = get(web, "good/..%2f..%2fclip.mp4", tmp_path / "inside" / "deep")
    assert path.resolve().parent == (tmp_path / "inside" / "deep").resolve()


def test_a_search_page_is_read_flat(web: Web) -> None:
    found = source("site").search("apt", f"{web.url}/search?q={{query}}", 10, PATIENT, NOW)
    requested = {path for path, _ in web.requests}
    titles = [candidate.title for candidate in found]
    assert (titles, requested) == (["The good one", "Gone", "A long way & round"], {"/search"})


def test_the_words_of_a_query_are_quoted_into_the_address(web: Web) -> None:
    address = f"{web.url}/search/{{query}}"
    source("site").search("apt & co/x", address, 10, PATIENT, NOW)
    assert web.times("/search/apt+%26+co%2Fx") == 1


def test_a_server_lists_its_own_videos(web: Web) -> None:
    found = source("server").search("", f"{web.url}/files/", 10, PATIENT, NOW)
    assert [c.url.removeprefix(web.url) for c in found] == ["/good/clip.mp4", "/half/clip.webm"]


def test_links_of_a_page_are_relative_to_where_it_was_redirected_to(web: Web) -> None:
    found = source("server").search("", f"{web.url}/files/listed", 10, PATIENT, NOW)
    addresses = [c.url.removeprefix(web.url) for c in found]
    assert addresses == ["/files/good/clip.mp4", "/half/clip.webm"]


@pytest.mark.parametrize("name", ["site", "server"])
def test_a_page_that_is_not_there_is_a_failed_search(web: Web, name: str) -> None:
    with pytest.raises(SearchFailed, match="404"):
        source(name).search("", f"{web.url}/missing/", 10, PATIENT, NOW)


def test_a_search_that_yt_dlp_does_not_know_is_a_failed_search() -> None:
    with pytest.raises(SearchFailed):
        listing("nosuchsearch5:apt", PATIENT)


@pytest.mark.network
def test_youtube_answers_a_search() -> None:
    found = source("youtube").search("APT dance", "", 10, WebConfig(), NOW)
    assert len(found) > 0
    assert all(candidate.view_count is not None for candidate in found)
