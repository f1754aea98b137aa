"""A request that failed for now is made again, also where yt-dlp reports its failure as text."""

import math
from pathlib import Path

import pytest

from robojackson.clips.web.download_formats import FormatConfig
from robojackson.clips.web.request_failures import explain
from robojackson.clips.web.yt_dlp_client import WebConfig, fetch, offer
from robojackson.errors import DownloadFailed
from tests.fixtures.web_server import PATIENT, Web

ONCE = WebConfig(retries=0, timeout_s=1.0, request_pause_s=0.0, private_addresses=True)
FAULTS = {
    "broken": "HTTP 503 Service Unavailable",
    "busy": "HTTP 429 too many requests",
    "stall": "the server fell silent",
    "half": "the server cut the file short",
    "cut_chunk": "the server cut the file short",
    "reset": "the server cut the connection",
    "reset_midway": "the server cut the connection",
    "hung_up": "the server cut the connection",
}
"""Kinds of answers of the server, and the reason of each."""
TEXTS = {
    "HTTP Error 502: Bad Gateway": ("HTTP 502 Bad Gateway", True, math.inf),
    "HTTP Error 404: Not Found. Giving up after 2 retries": (
        "a piece of the video: HTTP 404 not found",
        False,
        math.inf,
    ),
    "[SSL: UNEXPECTED_EOF_WHILE_READING] EOF occurred in violation of protocol (_ssl.c:1006)": (
        "the server cut the connection",
        True,
        math.inf,
    ),
    "HTTPConnection(host='h', port=80): Failed to establish a new connection: [Errno 111] no": (
        "no connection (Failed to establish a new connection: [Errno 111] no)",
        True,
        math.inf,
    ),
    "HTTPConnection(host='h', port=80): Failed to resolve 'h' ([Errno -2] unknown)": (
        "no connection (Failed to resolve 'h' ([Errno -2] unknown))",
        True,
        1,
    ),
    "fragment 2 not found, unable to continue": (
        "a piece of the video is empty or too large",
        False,
        math.inf,
    ),
    "unable to open for writing: no space": (
        "unable to open for writing: no space",
        False,
        math.inf,
    ),
}
"""Texts of yt-dlp's downloader: reason, whether it may pass, most retries."""


@pytest.mark.medium
@pytest.mark.parametrize("fault", FAULTS)
def test_a_download_that_failed_once_is_made_again(web: Web, fault: str, tmp_path: Path) -> None:
    chosen = offer(f"{web.url}/good/clip.mp4", "score", FormatConfig(), PATIENT)
    web.faults = [fault]
    assert fetch(chosen, tmp_path, PATIENT).read_bytes() == web.video
    assert not web.faults


@pytest.mark.medium
@pytest.mark.parametrize("fault", FAULTS)
def test_a_download_that_failed_for_good_is_a_plain_reason(
    web: Web, fault: str, tmp_path: Path
) -> None:
    chosen = offer(f"{web.url}/good/clip.mp4", "score", FormatConfig(), ONCE)
    web.faults = [fault]
    with pytest.raises(DownloadFailed) as failure:
        fetch(chosen, tmp_path, ONCE)
    assert str(failure.value) == FAULTS[fault]


@pytest.mark.parametrize("text", TEXTS)
def test_a_text_of_the_downloader_has_a_meaning(text: str) -> None:
    from yt_dlp.utils import DownloadError

    found = explain(DownloadError(f"ERROR: \r[download] Got error: {text}"))
    assert (found.reason, found.passing, found.most_retries) == TEXTS[text]


def test_a_private_file_of_a_public_page_is_refused_at_once(web: Web, tmp_path: Path) -> None:
    chosen = offer(f"{web.url}/good/clip.mp4", "score", FormatConfig(), PATIENT)
    before = len(web.requests)
    with pytest.raises(DownloadFailed, match=r"^127\.0\.0\.1 is no address .* allows it$"):
        fetch(chosen, tmp_path, WebConfig(retries=1, backoff_s=60.0, request_pause_s=0.0))
    assert len(web.requests) == before
