"""Text from the web: titles, ids and addresses. None of it is trusted.

A title may hold control characters, a thousand letters or letters that run from right to left; an
id may be `../../x`. What leaves this module fits into one cell of a table and one part of a path.
"""

import hashlib
import re
import unicodedata
from urllib.parse import quote, urlsplit, urlunsplit

TITLE_LENGTH = 120
"""Characters; the longest title of YouTube has 100."""
NAME = re.compile(r"[A-Za-z0-9_-]{1,64}")
MARKS_A_LETTER = 2
FIRST_STRONG_ISOLATE, POP_ISOLATE = "\u2068", "\u2069"
SAFE_IN_URL = "%/:=&?~#+!$,;'@()*[]-._"


def clean_text(text: object, length: int = TITLE_LENGTH) -> str:
    """Return one line of printable characters, at most `length` of them.

    Control and formatting characters (escape sequences, joiners, overrides of the writing
    direction) go, runs of white space become one space, and no letter keeps more than two marks.
    """
    kept: list[str] = []
    marks = 0
    for character in str(text or ""):
        category = unicodedata.category(character)
        marks = marks + 1 if category in ("Mn", "Me") else 0
        if category[0] == "Z" or character in "\t\n\r\v\f":
            kept.append(" ")
        elif category[0] != "C" and marks <= MARKS_A_LETTER:
            kept.append(character)
    line = " ".join("".join(kept).split())
    return line if len(line) <= length else line[: length - 1].rstrip() + "…"


def isolated(text: str) -> str:
    """Return the text itself, or set apart where it holds letters that run from right to left.

    A terminal that knows the two isolates keeps the cells beside it where they are; the isolates
    take no room.
    """
    if any(unicodedata.bidirectional(c) in ("R", "AL", "AN") for c in text):
        return f"{FIRST_STRONG_ISOLATE}{text}{POP_ISOLATE}"
    return text


def safe_name(raw: object, address: str = "") -> str:
    """Return a part of a path: letters, digits, `_` and `-`, at most 64.

    A name that is one already stays as it is. Another one becomes its readable letters and a
    digest, so that two names never become one.

    Args:
        raw: An id from the web.
        address: Put into the digest too, where the id alone is not unique.
    """
    text = str(raw or "")
    if NAME.fullmatch(text) and not address:
        return text
    digest = hashlib.sha256(f"{text}\0{address}".encode(errors="replace")).hexdigest()[:12]
    readable = re.sub(r"[^A-Za-z0-9]+", "-", text).strip("-")[:32].strip("-")
    return f"{readable}-{digest}" if readable else f"x-{digest}"


def web_address(raw: object) -> str:
    """Return an http or https address without control characters, its spaces escaped and the name
    of its host in ASCII (IDNA) as browsers do; empty for another one, or one with a space in the
    name of its host."""
    text = "".join(c for c in str(raw or "") if unicodedata.category(c)[0] != "C").strip()
    try:
        parts = urlsplit(text)
        if parts.scheme.lower() not in ("http", "https") or not parts.hostname:
            return ""
        if len(parts.netloc.split()) > 1:
            return ""
        if not parts.netloc.isascii():
            text = urlunsplit(parts._replace(netloc=_in_ascii(parts.netloc)))
    except ValueError:
        return ""
    return quote(text, safe=SAFE_IN_URL)


def _in_ascii(place: str) -> str:
    """Return user, host and port of an address with the host as name servers know it.

    Raises:
        ValueError: there is no such name.
    """
    user, at, rest = place.rpartition("@")
    host, colon, port = rest.partition(":")
    return f"{user}{at}{host.encode('idna').decode()}{colon}{port}"


def in_markdown(text: str) -> str:
    """Return the text with everything escaped that Markdown or HTML would take for itself."""
    escaped = text.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")
    return re.sub(r"([\\`*_{}\[\]()#+!|~-])", r"\\\1", escaped)
