"""The user's cookie file (Netscape format): read and checked, never written.

yt-dlp writes its cookies back at the end of each request, and empties a file that it cannot fill;
so it gets the content as a stream of text.
"""

import io
import os
import re
from pathlib import Path

from robojackson.errors import BadConfiguration
from robojackson.files.foreign_file import read_text

KEY = "web.cookies_file"
LARGEST = 2**24
"""Bytes; a browser's file has fewer than a million."""
FIRST_LINE = re.compile(r"#( Netscape)? HTTP Cookie File")
ADVICE = "give a cookie file in Netscape format, or null"


def require_cookies(path: Path | None) -> None:
    """Raise `BadConfiguration` where a cookie file is named and cannot be read."""
    if path is not None:
        open_cookies(path)


def open_cookies(path: Path) -> io.StringIO:
    """Return the content of a cookie file; `~` and variables of the environment are expanded.

    Raises:
        BadConfiguration: it is missing, cannot be read, or has another format.
    """
    place = Path(os.path.expanduser(os.path.expandvars(path)))
    try:
        text = read_text(place, BadConfiguration, LARGEST)
    except BadConfiguration as cause:
        raise _refusal(place, cause.reason) from cause
    if not FIRST_LINE.match(text):
        raise _refusal(place, "its first line is not '# Netscape HTTP Cookie File'")
    return io.StringIO(text, newline=None)


def _refusal(place: Path, reason: str) -> BadConfiguration:
    return BadConfiguration(f"{KEY}: {place}: {reason}; {ADVICE}", key=KEY)
