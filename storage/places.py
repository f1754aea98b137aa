"""The two kinds of place that keep the files of a store: a folder, and whatever fsspec reaches.

Every write is whole or absent: on a disk a temporary name, fsync, then rename; in an object store
one PUT; elsewhere a temporary name, then a move. Errors are those of the place; `Store` words them.
"""

import fcntl
import os
import shutil
import tempfile
from pathlib import Path
from typing import Any, Protocol

import fsspec

from storage.artifact import sha256_of, sha256_of_file

CHUNK = 1 << 20
TEMPORARY = ".part-"
PUT_IS_ATOMIC = frozenset(("s3", "s3a", "gs", "gcs", "abfs", "az", "memory"))
"""fsspec protocols in which a file is there whole or not at all."""


class Place(Protocol):
    """What a store needs of a place; keys are relative, `/` between their parts."""

    def create(self) -> None:
        """Make the place itself (a folder, a bucket), if it is not there."""

    def put(self, key: str, source: Path | bytes) -> None:
        """Write a whole file or none."""

    def read(self, key: str) -> bytes:
        """The content of a file."""

    def sha256(self, key: str) -> str:
        """Digest of the content of a file."""

    def exists(self, key: str) -> bool:
        """Whether there is such a file."""

    def remove(self, key: str) -> None:
        """Take a file away."""

    def list(self, prefix: str) -> list[str]:
        """The keys of the files under a folder."""

    def address(self, key: str) -> str:
        """What a person calls the file."""


def place_at(root: str) -> "Folder | Remote":
    """The place of an address: a URL is fsspec's, all else is a folder."""
    if "://" in root and not root.startswith("file://"):
        return Remote(root)
    return Folder(Path(root.removeprefix("file://")))


class Folder:
    """A folder on a disk."""

    def __init__(self, root: Path) -> None:
        self.root = root.absolute()
        if self.root.is_file():
            raise NotADirectoryError("a file; a folder is wanted")

    def create(self) -> None:
        self.root.mkdir(parents=True, exist_ok=True)

    def put(self, key: str, source: Path | bytes) -> None:
        target = (self.root / key).resolve()  # a link stays one
        if target.is_dir():
            raise IsADirectoryError("a folder; name a file in it")
        if target.exists() and not target.is_file():
            raise OSError("a device or a pipe; name a file")
        mode = target.stat().st_mode & 0o777 if target.exists() else 0o644
        target.parent.mkdir(parents=True, exist_ok=True)
        file = _begun(target.parent)
        try:
            with file:
                _fill(file, source)
                file.flush()
                os.fsync(file.fileno())
                os.chmod(file.name, mode)
                os.replace(file.name, target)
            _sync_folder(target.parent)
        finally:
            Path(file.name).unlink(missing_ok=True)

    def read(self, key: str) -> bytes:
        return (self.root / key).read_bytes()

    def sha256(self, key: str) -> str:
        return sha256_of_file(self.root / key)

    def exists(self, key: str) -> bool:
        return (self.root / key).is_file()

    def remove(self, key: str) -> None:
        (self.root / key).unlink(missing_ok=True)

    def list(self, prefix: str) -> list[str]:
        found = (p for p in (self.root / prefix).rglob("*") if p.is_file())
        return [p.relative_to(self.root).as_posix() for p in found if TEMPORARY not in p.name]

    def address(self, key: str) -> str:
        return str(self.root / key)


class Remote:
    """A place that fsspec reaches, such as an object store."""

    def __init__(self, url: str) -> None:
        self.url = url.rstrip("/")
        self._system, self._base = fsspec.core.url_to_fs(self.url)
        spoken = self._system.protocol
        protocols = {spoken} if isinstance(spoken, str) else set(spoken)
        self._put_is_atomic = bool(protocols & PUT_IS_ATOMIC)

    def create(self) -> None:
        self._system.makedirs(self._base, exist_ok=True)

    def put(self, key: str, source: Path | bytes) -> None:
        data = source if isinstance(source, bytes) else source.read_bytes()
        target = self._path(key)
        if self._put_is_atomic:
            self._system.pipe_file(target, data)
            return
        folder, name = target.rsplit("/", 1)
        unfinished = f"{folder}/{TEMPORARY}{os.getpid()}-{name}"
        self._system.makedirs(folder, exist_ok=True)
        try:
            self._system.pipe_file(unfinished, data)
            self._system.mv(unfinished, target)
        except BaseException:
            self._discard(unfinished)
            raise

    def read(self, key: str) -> bytes:
        self._system.invalidate_cache()
        return self._system.cat_file(self._path(key))

    def sha256(self, key: str) -> str:
        return sha256_of(self.read(key))

    def exists(self, key: str) -> bool:
        self._system.invalidate_cache()
        return self._system.isfile(self._path(key))

    def remove(self, key: str) -> None:
        self._system.rm_file(self._path(key))

    def list(self, prefix: str) -> list[str]:
        self._system.invalidate_cache()
        found = self._system.find(self._path(prefix))
        return [p.removeprefix(self._base).lstrip("/") for p in found if TEMPORARY not in p]

    def address(self, key: str) -> str:
        return f"{self.url}/{key}"

    def _path(self, key: str) -> str:
        return f"{self._base}/{key}" if key else self._base

    def _discard(self, path: str) -> None:
        if self._system.exists(path):
            self._system.rm_file(path)


def _begun(folder: Path) -> Any:
    """A temporary file that is held: what nobody holds is a dead process's, and swept away."""
    while True:
        file = tempfile.NamedTemporaryFile(prefix=TEMPORARY, dir=folder, delete=False)  # noqa: SIM115
        fcntl.flock(file, fcntl.LOCK_EX)
        if Path(file.name).exists():
            return file
        file.close()  # it was swept away before it was held


def _fill(file: Any, source: Path | bytes) -> None:
    if isinstance(source, bytes):
        file.write(source)
        return
    with source.open("rb") as origin:
        shutil.copyfileobj(origin, file, CHUNK)


def _sync_folder(path: Path) -> None:
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
