"""Explain why a request to the web failed, and whether to retry it."""

import math
import re
import socket
from typing import Any, NamedTuple

from robojackson.clips.web.untrusted_text import clean_text

BUSY, SERVER_FAULT = 429, 500
REASON_LENGTH = 200
UNRESOLVED = "failed to resolve"
CONNECTION = re.compile(r"^HTTPS?Connection\([^)]*\): ")
"""What urllib3 writes before its reason: the host stands in the reason, too."""
STATUS = re.compile(r"HTTP Error (\d{3})(?:: ([^.;]+))?")
SHORT = re.compile(r"bytes read|more expected")
CUT = re.compile(r"Connection (?:broken|aborted)|reset by peer|EOF occurred in violation", re.I)
UNCONNECTED = re.compile(f"{UNRESOLVED}|failed to establish a new connection", re.I)
PREFIXES = re.compile(r"^(?:ERROR: )?(?:\[download\] Got error: )?")
"""What yt-dlp writes before the reason of a download."""
PIECE = re.compile(r"fragment \d+ not found")
"""What it writes where a piece of a stream was empty, or larger than a whole file may be."""
NO_FORMAT = "Requested format is not available"
EXTERNAL = re.compile(r"(?:ffmpeg|rtmpdump).*install", re.I)
ONLY_EXTERNAL = (
    "only an external program (FFmpeg) could read this stream, such as one of unknown encryption, "
    "and none is started; choose another video, or use a file of this one"
)


class Failure(NamedTuple):
    """Why a request failed, and whether to retry it.

    Attributes:
        reason: Reason in one line.
        passing: Whether another attempt makes sense.
        wait_s: Seconds that the server requests to wait.
        most_retries: How often it makes sense at most; a name that cannot be resolved is soon sure.
    """

    reason: str
    passing: bool
    wait_s: float
    most_retries: float = math.inf


def explain(failure: BaseException) -> Failure:
    """Return what an error of yt-dlp, or one inside it, means."""
    from yt_dlp.networking.exceptions import HTTPError, IncompleteRead, TransportError
    from yt_dlp.utils import ContentTooShortError

    for cause in _causes(failure):
        if isinstance(cause, HTTPError):
            retry_after = str(cause.response.headers.get("Retry-After") or "")
            wait_s = float(retry_after) if retry_after.isdigit() else 0.0
            answered = clean_text(cause.reason or "", 60)
            return Failure(_status(cause.status, answered), _is_passing(cause.status), wait_s)
        if isinstance(cause, IncompleteRead | ContentTooShortError):
            return Failure("the server cut the file short", True, 0.0)
        if isinstance(cause, TimeoutError) or "timed out" in str(cause).lower():
            return Failure("the server fell silent", True, 0.0)
        if isinstance(cause, TransportError):
            return _no_connection(_line(cause), isinstance(cause, socket.gaierror))
    return _from_text(_line(failure))


def _from_text(text: str) -> Failure:
    """Return what a message means: yt-dlp's downloader reports no cause beside it.

    A status below 500 comes with its cause, except that of a piece of a stream.
    """
    if answer := STATUS.search(text):
        status = int(answer[1])
        passing, line = _is_passing(status), _status(status, clean_text(answer[2] or "", 60))
        return Failure(line if passing else f"a piece of the video: {line}", passing, 0.0)
    if SHORT.search(text):
        return Failure("the server cut the file short", True, 0.0)
    if CUT.search(text):
        return Failure("the server cut the connection", True, 0.0)
    if UNCONNECTED.search(text):
        return _no_connection(text)
    if PIECE.search(text):
        return Failure("a piece of the video is empty or too large", False, 0.0)
    if NO_FORMAT in text:
        return Failure("no format with a picture that can be downloaded", False, 0.0)
    return Failure(ONLY_EXTERNAL if EXTERNAL.search(text) else text, False, 0.0)


def _no_connection(text: str, no_name: bool = False) -> Failure:
    most = 1 if no_name or UNRESOLVED in text.lower() else math.inf
    return Failure(f"no connection ({CONNECTION.sub('', text)})", True, 0.0, most)


def _causes(failure: BaseException) -> list[BaseException]:
    """Return an error and all that yt-dlp hid inside it, the innermost first."""
    found: list[BaseException] = []
    waiting: list[Any] = [failure]
    while waiting:
        error = waiting.pop()
        if isinstance(error, BaseException) and error not in found:
            found.append(error)
            hidden = (getattr(error, "exc_info", None) or (None, None))[1]
            inner = (error.__cause__, error.__context__, getattr(error, "cause", None), hidden)
            waiting.extend(e for e in inner if e is not None)
    return found[::-1]


def _status(status: int, answered: str) -> str:
    kind = {404: "not found", 410: "gone", BUSY: "too many requests", 403: "forbidden"}
    usual = "redirects without end" if 300 <= status < 400 else answered
    return f"HTTP {status} {kind.get(status, usual)}".rstrip()


def _is_passing(status: int) -> bool:
    return status == BUSY or status >= SERVER_FAULT


def _line(error: BaseException) -> str:
    """Return yt-dlp's message without its prefixes and its advice about reporting bugs."""
    text = clean_text(str(error) or type(error).__name__, 10 * REASON_LENGTH)
    text = PREFIXES.sub("", text).split("; please report this issue")[0]
    return clean_text(text.split(" (caused by")[0], REASON_LENGTH)
