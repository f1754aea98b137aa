"""Places of a store: a folder of this machine, or any address that fsspec reaches.

Every write is whole or absent: on a disk a temporary name, fsync, then rename; in an object store
one PUT, or parts that it joins when it has all; elsewhere a temporary name, then a move. Errors are
those of the place; `FileTree` words them.
"""

import os
from pathlib import Path

import fsspec

from robojackson.files.local_folder import TEMPORARY, LocalFolder, folder_of, sha256_of

PUT_IS_ATOMIC = frozenset(("s3", "s3a", "gs", "gcs", "abfs", "az", "memory"))
"""fsspec protocols in which a file is there whole or not at all."""
S3 = frozenset(("s3", "s3a"))
PART, AT_ONCE = 16 << 20, 2
"""Bytes of a part of a local file on its way to S3, and parts in memory at a time: by itself s3fs
reads 500 MB before it sends any, in each of the threads of a restore."""


def place_at(root: str) -> "LocalFolder | Remote":
    """Return the place of an address: a URL is fsspec's, all else is a folder."""
    folder = folder_of(root)
    return Remote(root) if folder is None else LocalFolder(folder)


class Remote:
    """A place that fsspec reaches, such as an object store."""

    def __init__(self, url: str) -> None:
        self.url = url.rstrip("/")
        self._system, self._base = fsspec.core.url_to_fs(self.url)
        spoken = self._system.protocol
        protocols = {spoken} if isinstance(spoken, str) else set(spoken)
        self._put_is_atomic = bool(protocols & PUT_IS_ATOMIC)
        in_parts = {"chunksize": PART, "max_concurrency": AT_ONCE}
        self._upload = in_parts if protocols & S3 else {}

    def create(self) -> None:
        """Make the bucket or folder."""
        self._system.makedirs(self._base, exist_ok=True)

    def put(self, key: str, source: Path | bytes) -> None:
        """Write a file, whole or not at all."""
        target = self._path(key)
        if self._put_is_atomic:
            self._send(source, target)
            return
        folder, name = target.rsplit("/", 1)
        unfinished = f"{folder}/{TEMPORARY}{os.getpid()}-{name}"
        self._system.makedirs(folder, exist_ok=True)
        try:
            self._send(source, unfinished)
            self._system.mv(unfinished, target)
        except BaseException:
            self._discard(unfinished)
            raise

    def read(self, key: str) -> bytes:
        """Return the content of a file."""
        self._system.invalidate_cache()
        return bytes(self._system.cat_file(self._path(key)))

    def sha256(self, key: str) -> str:
        """Return the digest of a file."""
        return sha256_of(self.read(key))

    def exists(self, key: str) -> bool:
        """Return whether there is such a file."""
        self._system.invalidate_cache()
        try:  # `isfile` takes every failure for a no
            return bool(self._system.info(self._path(key))["type"] == "file")
        except FileNotFoundError:
            return False

    def remove(self, key: str) -> None:
        """Remove a file."""
        self._system.rm_file(self._path(key))

    def list(self, prefix: str) -> list[str]:
        """Return the keys of all finished files under a prefix."""
        self._system.invalidate_cache()
        found = self._system.find(self._path(prefix))
        return [p.removeprefix(self._base).lstrip("/") for p in found if TEMPORARY not in p]

    def address(self, key: str) -> str:
        """Return the address of a key."""
        return f"{self.url}/{key}"

    def _path(self, key: str) -> str:
        return f"{self._base}/{key}" if key else self._base

    def _send(self, source: Path | bytes, target: str) -> None:
        if isinstance(source, bytes):
            self._system.pipe_file(target, source)
        else:
            self._system.put_file(str(source), target, **self._upload)

    def _discard(self, path: str) -> None:
        if self._system.exists(path):
            self._system.rm_file(path)
