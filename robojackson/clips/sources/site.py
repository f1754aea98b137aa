"""Any page that yt-dlp reads: a channel, a playlist, a feed, a search page of a site."""

from collections.abc import Mapping
from datetime import datetime
from typing import Any
from urllib.parse import quote_plus

from robojackson.clips.web.video_candidate import VideoCandidate, from_info
from robojackson.clips.web.yt_dlp_client import WebConfig, entries, listing
from robojackson.errors import SearchFailed


def page(query: str, address: str) -> str:
    """Return the page of the site."""
    return address


def search(
    query: str, address: str, count: int, config: WebConfig, now: datetime
) -> list[VideoCandidate]:
    """Return the videos of a page; `{query}` in its address becomes the words, quoted."""
    if not address:
        raise SearchFailed("site: no address; give one such as https://host/search?q={query}")
    page = address.replace("{query}", quote_plus(query))
    return candidates(listing(page, config), query, now)[:count]


def candidates(
    info: Mapping[str, Any], query: str, now: datetime, page: str = ""
) -> list[VideoCandidate]:
    """Return the candidates of what yt-dlp returned for a page."""
    found = (from_info(entry, query, now, page) for entry in entries(info))
    return [candidate for candidate in found if candidate is not None]
