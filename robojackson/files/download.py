"""Download one file of a known digest, whole or not at all; resume a download that was cut off."""

import http.client
import os
import urllib.error
import urllib.request
from pathlib import Path

from robojackson.errors import DownloadFailed
from robojackson.files.local_folder import CHUNK, sha256_of_file

TIMEOUT_S = 30.0
ATTEMPTS = 3
"""Connections in a row that may break off."""
PART = ".part"
"""Suffix of a file that is not complete yet."""
REJECTED, PARTIAL = 416, 206
"""HTTP: no such range; a part of the file."""


def download(url: str, target: Path, size: int, sha256: str) -> None:
    """Download a file; resume where an earlier call was cut off.

    Args:
        target: Path of the complete file with the expected digest; its folder exists.
        size: Bytes.
        sha256: Digest of its content.

    Raises:
        DownloadFailed: the server cannot be reached, refuses the file, or sends another file.
        OSError: the target cannot be written.
    """
    part = target.with_name(target.name + PART)
    cut: Exception | None = None
    for _ in range(ATTEMPTS):
        try:
            _fetch(url, part, size)
        except (http.client.HTTPException, OSError) as cause:
            if not _is_remote(cause):
                raise
            cut = cause
        if part.is_file() and part.stat().st_size >= size:
            break
    _require_whole(url, part, size, cut)
    digest = sha256_of_file(part)
    if digest != sha256 or part.stat().st_size != size:
        part.unlink()
        raise DownloadFailed(
            f"{url} sends another file than the pinned one: its sha256 is {digest}, expected "
            f"{sha256}; nothing was saved"
        )
    part.replace(target)


def _fetch(url: str, part: Path, size: int) -> None:
    """Append the missing bytes of a file to its part; one byte more where the file is longer."""
    have = part.stat().st_size if part.is_file() else 0
    if have >= size:
        return
    request = urllib.request.Request(url, headers={"User-Agent": "robojackson"})
    if have:
        request.add_header("Range", f"bytes={have}-")
    try:
        answer = urllib.request.urlopen(request, timeout=TIMEOUT_S)
    except urllib.error.HTTPError as cause:
        if have and cause.code == REJECTED:
            part.unlink()
            return
        raise DownloadFailed(
            f"{url} cannot be downloaded: HTTP {cause.code} {cause.reason}"
        ) from cause
    with answer, part.open("ab" if have and answer.status == PARTIAL else "wb") as file:
        left = size + 1 - file.tell()
        while left > 0 and (piece := answer.read(min(CHUNK, left))):
            file.write(piece)
            left -= len(piece)
        file.flush()
        os.fsync(file.fileno())


def _require_whole(url: str, part: Path, size: int, cut: Exception | None) -> None:
    have = part.stat().st_size if part.is_file() else 0
    if have >= size:
        return
    reason = getattr(cut, "reason", None) or cut or "the server ended it"
    if not have:
        raise DownloadFailed(
            f"{url} cannot be downloaded: {reason}; check the network, then try again"
        ) from cut
    raise DownloadFailed(
        f"{url} was cut off after {have:,} of {size:,} bytes ({reason}); the same command goes on"
    ) from cut


def _is_remote(cause: Exception) -> bool:
    """Return whether the network failed, not the disk."""
    network = (urllib.error.URLError, http.client.HTTPException, TimeoutError, ConnectionError)
    return isinstance(cause, network)
