"""A video that may be danced, as its source describes it before anything is downloaded."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import datetime
from typing import Any

from robojackson.clips.web.untrusted_text import clean_text, safe_name, web_address

GENERIC = "generic"
"""yt-dlp's extractor for any page: its ids are the last part of an address, so not unique."""
LIVE = ("is_live", "is_upcoming", "post_live", "was_live")
LONGEST_COUNT = 2**62


@dataclass(frozen=True)
class VideoCandidate:
    """One video.

    Attributes:
        video_id: Unique within its source, and fit to be a part of a path.
        url: Where it is: an http address, or the path of a local file.
        title: One line.
        query: What was searched for.
        source: Where it was found: `folder`, or the name of yt-dlp's extractor.
        duration_s: Seconds; None when the source does not give it.
        view_count: How often it was watched.
        width, height: Pixels.
        thumbnail: Address of a picture, `` without one.
        live: Whether it is, was or will be a live stream.
        retrieved_at: When the source was queried; not part of the video's identity.
    """

    video_id: str
    url: str
    title: str
    query: str
    source: str
    duration_s: float | None = None
    view_count: int | None = None
    width: int | None = None
    height: int | None = None
    thumbnail: str = ""
    live: bool = False
    retrieved_at: datetime | None = field(default=None, compare=False)

    @property
    def key(self) -> tuple[str, str]:
        """Identity of a video."""
        return self.source, self.video_id


def from_info(
    info: Mapping[str, Any], query: str, retrieved_at: datetime, page: str = ""
) -> VideoCandidate | None:
    """Return the candidate of a dictionary that yt-dlp returned, flat or full; None without an
    address.

    Args:
        info: One entry; https://github.com/yt-dlp/yt-dlp#output-template names its keys.
        query: What was searched for.
        retrieved_at: Time of the search.
        page: Address of the page that held it, for an entry that has none of its own.
    """
    url = _address(info) or web_address(page)
    if not url:
        return None
    source = safe_name(str(info.get("ie_key") or info.get("extractor_key") or GENERIC).lower())
    return VideoCandidate(
        video_id=safe_name(info.get("id"), url if source == GENERIC or not info.get("id") else ""),
        url=url,
        title=clean_text(info.get("title")),
        query=clean_text(query),
        source=source,
        duration_s=_number(info.get("duration")),
        view_count=_count(info.get("view_count")),
        width=_count(info.get("width")),
        height=_count(info.get("height")),
        thumbnail=_thumbnail(info),
        live=bool(info.get("is_live")) or info.get("live_status") in LIVE,
        retrieved_at=retrieved_at,
    )


def _address(info: Mapping[str, Any]) -> str:
    """Return the page of a video, or its file where a page holds several."""
    formats = info.get("formats") or []
    last = formats[-1].get("url") if formats and isinstance(formats[-1], Mapping) else None
    is_embedded = bool(formats) and info.get("_type", "video") == "video"
    first = last if is_embedded and not info.get("webpage_url") else None
    found = (first, info.get("webpage_url"), info.get("url"), info.get("original_url"), last)
    return next((url for raw in found if (url := web_address(raw))), "")


def _thumbnail(info: Mapping[str, Any]) -> str:
    """Return the widest picture that a flat entry lists, or the one of a full entry."""
    listed = [t for t in info.get("thumbnails") or [] if isinstance(t, Mapping)]
    widest = max(listed, key=lambda t: _number(t.get("width")) or 0.0, default={})
    return web_address(info.get("thumbnail") or widest.get("url"))


def _number(value: Any) -> float | None:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    return float(value) if math.isfinite(value) and value >= 0 else None


def _count(value: Any) -> int | None:
    number = _number(value)
    return None if number is None or number > LONGEST_COUNT else int(number)
