"""The version of a file behind an address: what its server reports of it without sending it.

A file that is replaced under its address is another video. A server that does not answer, or
reports nothing of a file, leaves the address alone to identify it.
"""

import hashlib
import http.client
import re
import urllib.request
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from urllib.parse import urlsplit

from robojackson.clips.video import SUFFIXES
from robojackson.clips.web.address_guard import opened
from robojackson.clips.web.video_candidate import GENERIC, VideoCandidate
from robojackson.clips.web.yt_dlp_client import WebConfig

VERSIONS, LENGTH = ("ETag", "Last-Modified"), "Content-Length"
"""Headers that change with a file; of the versions the first that is there counts, since some
servers give the time of the request as that of the change."""
PATIENCE_S = 5.0
"""Longest silence of a server, seconds."""
AT_ONCE = 4
"""Questions to servers at the same time."""
DIGITS = 8
SUFFIX = re.compile(f"-[0-9a-f]{{{DIGITS}}}")
"""What a version adds to the id of a video."""


def versioned(found: Sequence[VideoCandidate], config: WebConfig) -> tuple[VideoCandidate, ...]:
    """Return candidates whose ids have the versions of their files, where these have some."""
    with ThreadPoolExecutor(AT_ONCE) as pool:
        return tuple(pool.map(lambda each: _versioned(each, config), found))


def _versioned(found: VideoCandidate, config: WebConfig) -> VideoCandidate:
    is_file = urlsplit(found.url).path.lower().endswith(SUFFIXES)
    facts = _facts(found.url, config) if is_file and found.source == GENERIC else ""
    if not facts:
        return found
    digest = hashlib.sha256(facts.encode(errors="replace")).hexdigest()[:DIGITS]
    return replace(found, video_id=f"{found.video_id}-{digest}")


def _facts(url: str, config: WebConfig) -> str:
    """Return what a server reports of a file; empty where it reports nothing, or sends a page."""
    request = urllib.request.Request(url, method="HEAD", headers={"User-Agent": "robojackson"})
    patience_s = min(config.timeout_s, PATIENCE_S)
    try:
        with opened(request, config.private_addresses, config.proxy, patience_s) as answer:
            if answer.headers.get_content_type() == "text/html":
                return ""
            versions = [answer.headers[name] for name in VERSIONS if answer.headers[name]]
            return "\n".join([*versions[:1], *filter(None, [answer.headers[LENGTH]])])
    except (OSError, ValueError, http.client.HTTPException):
        return ""
