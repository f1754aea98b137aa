"""Read files from outside: one plain file of limited size; JSON of limited depth."""

import json
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NoReturn

from robojackson.errors import BadTable, RoboJacksonError, StoreError

Json = Any
"""What a JSON text may hold."""
LARGEST = 2**28
"""Bytes of a file that is read into memory; an hour of motion has fewer."""
VIDEO = re.compile(rb"....ftyp|\x1aE\xdf\xa3|RIFF....AVI ", re.DOTALL)
"""How an MP4 or MOV, a WebM or MKV, and an AVI begin."""


def require_file(
    path: Path,
    error: type[RoboJacksonError] = StoreError,
    largest: int = LARGEST,
    usual: Sequence[str] = (),
) -> None:
    """Raise an error for a path that cannot be read as one file.

    Args:
        path: The file.
        error: Class of the error.
        largest: Largest allowed size, bytes.
        usual: Names that such a file has in the folder of a stage, the likeliest first.

    Raises:
        RoboJacksonError: the path is a folder, a device or a pipe, missing, or too large.
    """
    if path.is_dir():
        meant = next((each for name in usual if (each := path / name).is_file()), None)
        raise error(f"a folder, not a file{f'; did you mean {meant}?' if meant else ''}", path)
    if not path.is_file():
        raise error("no such file" if not path.exists() else "a device or a pipe, not a file", path)
    if (size := path.stat().st_size) > largest:
        raise error(f"{size:,} bytes; at most {largest:,} are read", path)


def read_file(
    path: Path,
    error: type[RoboJacksonError] = StoreError,
    largest: int = LARGEST,
    usual: Sequence[str] = (),
) -> bytes:
    """Return the content of a file, checked by `require_file`.

    Raises:
        RoboJacksonError: the file cannot be read.
    """
    require_file(path, error, largest, usual)
    try:
        return path.read_bytes()
    except OSError as cause:
        raise error(f"cannot be read: {cause.strerror}", path) from cause


def refuse_video(data: bytes, where: object) -> None:
    """Raise an error with the remedy where a video was given as a motion.

    Raises:
        BadTable: the content is a video.
    """
    if VIDEO.match(data):
        raise BadTable(
            "a video; `robojackson mocap` recovers its dancer's motion, `robojackson dance` does "
            "all stages",
            where,
        )


def read_text(
    path: Path, error: type[RoboJacksonError] = StoreError, largest: int = LARGEST
) -> str:
    """Return the content of a text file without its byte order mark.

    Raises:
        RoboJacksonError: the file cannot be read, or is not text.
    """
    try:
        return read_file(path, error, largest).decode("utf-8-sig")
    except UnicodeDecodeError as cause:
        raise error(f"no text in UTF-8 ({cause.reason} at byte {cause.start})", path) from cause


def read_json(
    path: Path, error: type[RoboJacksonError] = StoreError, largest: int = LARGEST
) -> Json:
    """Return the value of a JSON file.

    Raises:
        RoboJacksonError: the file cannot be read, or is no JSON.
    """
    try:
        return parse_json(read_text(path, error, largest))
    except ValueError as cause:
        raise error(f"no JSON ({cause})", path) from cause


def parse_json(text: str | bytes, finite: bool = False) -> Json:
    """Return the value of a JSON text.

    Args:
        finite: Whether to refuse NaN and infinity, which Python's JSON accepts.

    Raises:
        ValueError: the text is damaged, or its lists and objects are nested too deeply.
    """
    try:
        return json.loads(text, parse_constant=_no_constant if finite else None)
    except RecursionError:
        raise ValueError("lists and objects are nested too deeply") from None


def _no_constant(name: str) -> NoReturn:
    raise ValueError(f"{name} is not a number")
