"""A folder of video files; each is its own candidate, wherever a copy of it stands, and another one
when its content is another."""

import hashlib
from datetime import datetime
from pathlib import Path

from robojackson.clips.video import list_videos
from robojackson.clips.web.untrusted_text import clean_text, safe_name
from robojackson.clips.web.video_candidate import VideoCandidate
from robojackson.clips.web.yt_dlp_client import WebConfig
from robojackson.errors import SearchFailed, UnreadableVideo

NAME = "folder"
IS_LOCAL = True


def search(
    query: str, address: str, count: int, config: WebConfig, now: datetime
) -> list[VideoCandidate]:
    """Return the videos directly inside a folder, by name; all of them, for any count and words
    are."""
    words = query if address else ""
    return [_candidate(path.absolute(), words, now) for path in videos(query, address)]


def videos(query: str, address: str) -> tuple[Path, ...]:
    """Return the files of a search.

    Raises:
        SearchFailed: the folder is not there, or holds no video.
    """
    try:
        return list_videos(Path(address or query))
    except (UnreadableVideo, OSError) as cause:
        raise SearchFailed(f"{NAME}: {clean_text(cause)}") from cause


def _candidate(path: Path, query: str, now: datetime) -> VideoCandidate:
    name = safe_name(path.stem, f"{path} {_digest(path)}")
    return VideoCandidate(name, str(path), clean_text(path.name), query, NAME, retrieved_at=now)


def _digest(path: Path) -> str:
    """Return the sha256 of a file; nothing of one that cannot be read, as its download will say."""
    try:
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError:
        return ""
