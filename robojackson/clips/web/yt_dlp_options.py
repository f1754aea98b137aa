"""The options of yt-dlp that no configuration changes: quiet, whole or not at all, one process.

yt-dlp hands some streams (an unknown encryption, for example) to an external FFmpeg, which knows
neither the guard of addresses nor the limits of bytes and time. So it gets a path of FFmpeg that
cannot exist, and repairs no file: PyAV reads the pieces of a stream as they come.
"""

import logging
import os
from contextlib import suppress
from typing import Any

from robojackson.clips.web.javascript_runtimes import runtimes
from robojackson.clips.web.request_failures import REASON_LENGTH
from robojackson.clips.web.untrusted_text import clean_text

NO_PROGRAM = os.path.join(os.devnull, "ffmpeg")
"""A path that cannot exist: its folder is a device."""

log = logging.getLogger(__name__)


def fixed_options() -> dict[str, Any]:
    """Return the options; retries are the caller's, so yt-dlp itself makes each request once."""
    return {
        "quiet": True,
        "noprogress": True,
        "no_warnings": False,
        "logger": _Log(),
        "cachedir": False,
        "color": {"stdout": "never", "stderr": "never"},
        "noplaylist": True,
        "http_headers": {"Accept-Encoding": "identity"},
        "hls_prefer_native": True,
        "retries": 0,
        "extractor_retries": 0,
        "fragment_retries": 0,
        "skip_unavailable_fragments": False,
        "continuedl": True,
        "ffmpeg_location": NO_PROGRAM,
        "fixup": "never",
        "js_runtimes": {name: {"path": place} for name, place in runtimes().items()},
    }


def hide_ffmpeg() -> None:
    """Let yt-dlp find no FFmpeg on the path either.

    Where it finds one, it leaves AES-128 to it, which it can also decrypt itself. The place is
    private, but its own command line sets it; `ffmpeg_location` alone forbids the program.
    """
    from yt_dlp.postprocessor import FFmpegPostProcessor

    with suppress(AttributeError):
        FFmpegPostProcessor._ffmpeg_location.set(NO_PROGRAM)


class _Log:
    """yt-dlp's messages in our log, one clean line each."""

    def debug(self, message: str) -> None:
        log.debug("%s", clean_text(message, REASON_LENGTH))

    info = debug

    def warning(self, message: str) -> None:
        log.debug("yt-dlp: %s", clean_text(message, REASON_LENGTH))

    def error(self, message: str) -> None:
        log.debug("yt-dlp: %s", clean_text(message, REASON_LENGTH))
