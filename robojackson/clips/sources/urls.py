"""A list of addresses, one a line: in a file, or given with blanks between them."""

import logging
import re
from datetime import datetime
from pathlib import Path

from robojackson.clips.web.untrusted_text import clean_text, safe_name, web_address
from robojackson.clips.web.video_candidate import GENERIC, VideoCandidate
from robojackson.clips.web.yt_dlp_client import WebConfig
from robojackson.errors import SearchFailed
from robojackson.files.foreign_file import read_text

COMMENT_OF_A_LINE = re.compile(r"(?:^|\s)#")
"""Where a comment begins: without white space before it, the sign is a part of an address."""
IS_LOCAL = True
LARGEST = 2**24
"""Bytes of a list."""
log = logging.getLogger(__name__)


def search(
    query: str, address: str, count: int, config: WebConfig, now: datetime
) -> list[VideoCandidate]:
    """Return one candidate an address, unopened, for any count; what is no http address is left out
    with a warning."""
    lines = _lines(address or query)
    found = [(line, web_address(line)) for line in lines]
    for line, url in found:
        if not url:
            log.warning("urls: %s is no http or https address", clean_text(line))
    named = query if address else ""
    made = [_candidate(url, named, now) for _, url in found if url]
    if not made:
        raise SearchFailed(f"urls: {clean_text(address or query)} holds no address")
    return made


def _candidate(url: str, query: str, now: datetime) -> VideoCandidate:
    page, _, parameters = url.partition("?")
    last = page.rstrip("/").rsplit("/", 1)[-1]
    name = safe_name(last.rsplit(".", 1)[0], url)
    is_named = "." in last or not parameters  # clip.mp4, but watch?v=...
    title = last if is_named else f"{last}?{parameters}"
    return VideoCandidate(name, url, clean_text(title), query, GENERIC, retrieved_at=now)


def _lines(text: str) -> list[str]:
    """Return the lines of a file, or the words of a text."""
    if "://" not in text:
        path = Path(text)
        try:
            listed = read_text(path, SearchFailed, LARGEST).splitlines()
        except (SearchFailed, OSError, ValueError) as cause:
            reason = cause.reason if isinstance(cause, SearchFailed) else "cannot be read"
            raise SearchFailed(f"urls: {clean_text(text)}: {reason}") from cause
        bare = (COMMENT_OF_A_LINE.split(line, 1)[0].strip() for line in listed)
        return [line for line in bare if line]
    return text.split()
