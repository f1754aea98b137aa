"""YouTube's own search, by yt-dlp's `ytsearchN:`."""

from datetime import datetime

from robojackson.clips.sources.site import candidates
from robojackson.clips.web.video_candidate import VideoCandidate
from robojackson.clips.web.yt_dlp_client import WebConfig, listing

PREFIX, PAGE = "ytsearch", "https://www.youtube.com"


def page(query: str, address: str) -> str:
    """Return YouTube's page; unknown for another search prefix."""
    return PAGE if not address or address.startswith(PREFIX) else ""


def search(
    query: str, address: str, count: int, config: WebConfig, now: datetime
) -> list[VideoCandidate]:
    """Return the first videos of a search; `address` may be another search prefix of yt-dlp."""
    prefix = address or PREFIX
    return candidates(listing(f"{prefix}{count}:{query}", config), query, now)[:count]
