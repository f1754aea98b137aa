"""A plain HTTP server that lists its files, such as `python -m http.server` or an autoindex."""

import urllib.error
from datetime import datetime
from html.parser import HTMLParser
from urllib.parse import unquote, urljoin, urlsplit

from robojackson.clips.video import SUFFIXES
from robojackson.clips.web.address_guard import opened
from robojackson.clips.web.untrusted_text import clean_text, safe_name, web_address
from robojackson.clips.web.video_candidate import GENERIC, VideoCandidate
from robojackson.clips.web.yt_dlp_client import WebConfig
from robojackson.errors import SearchFailed

LARGEST_PAGE = 4_000_000
"""Bytes."""


def page(query: str, address: str) -> str:
    """Return the page that lists the files."""
    return address or query


def search(
    query: str, address: str, count: int, config: WebConfig, now: datetime
) -> list[VideoCandidate]:
    """Return the video files that a page links to, on the same server; all of them, for any count
    and words."""
    page = web_address(address or query)
    if not page:
        raise SearchFailed(f"server: {clean_text(address or query)} is no http address")
    links = _Links()
    page, text = _page(page, config)
    links.feed(text)
    own = (urljoin(page, link) for link in links.found)
    files = dict.fromkeys(url for url in own if _is_video(url, page))
    if not files:
        raise SearchFailed(f"server: {clean_text(page)} lists no video")
    return [_candidate(url, query if address else "", now) for url in files]


def _page(address: str, config: WebConfig) -> tuple[str, str]:
    """Return where a page is, which links are relative to, after redirections; and its text."""
    try:
        with opened(address, config.private_addresses, config.proxy, config.timeout_s) as answer:
            return answer.url, bytes(answer.read(LARGEST_PAGE)).decode("utf-8", "replace")
    except (OSError, ValueError) as cause:
        reason = f"HTTP {cause.code}" if isinstance(cause, urllib.error.HTTPError) else cause
        raise SearchFailed(f"server: {clean_text(address)}: {clean_text(reason)}") from cause


def _is_video(url: str, page: str) -> bool:
    parts = urlsplit(url)
    return parts.netloc == urlsplit(page).netloc and parts.path.lower().endswith(SUFFIXES)


def _candidate(url: str, query: str, now: datetime) -> VideoCandidate:
    last = unquote(urlsplit(url).path.rsplit("/", 1)[-1])
    name = safe_name(last.rsplit(".", 1)[0], url)
    address = web_address(url)
    return VideoCandidate(name, address, clean_text(last), query, GENERIC, retrieved_at=now)


class _Links(HTMLParser):
    """The targets of all links of a page."""

    def __init__(self) -> None:
        super().__init__()
        self.found: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Collect the links of a page (part of HTMLParser)."""
        if tag == "a":
            self.found += [value for name, value in attrs if name == "href" and value]
