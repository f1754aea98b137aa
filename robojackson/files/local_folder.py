"""A folder on a disk whose files are written whole or not at all.

A write goes to a temporary name, is flushed to the disk and then renamed. Errors are those of the
operating system; `file_tree.FileTree` words them.
"""

import fcntl
import hashlib
import os
import secrets
import shutil
from pathlib import Path
from typing import Any, Protocol

CHUNK = 1 << 20
TEMPORARY = ".part-"
"""Beginning of the names of files that are being written."""


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


class LocalFolder:
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
        mode = target.stat().st_mode & 0o777 if target.exists() else None
        target.parent.mkdir(parents=True, exist_ok=True)
        name, file = _begun(target.parent)
        try:
            with file:
                _fill(file, source)
                file.flush()
                os.fsync(file.fileno())
                if mode is not None:
                    os.chmod(name, mode)
                os.replace(name, target)
            _sync_folder(target.parent)
        finally:
            name.unlink(missing_ok=True)

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


def sha256_of(data: bytes) -> str:
    """Digest of bytes, in hexadecimal."""
    return hashlib.sha256(data).hexdigest()


def sha256_of_file(path: Path) -> str:
    """Digest of a local file, in hexadecimal; a device has no end."""
    if path.exists() and not path.is_file() and not path.is_dir():
        raise OSError("a device or a pipe, no file")
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _begun(folder: Path) -> tuple[Path, Any]:
    """A temporary file that is held: what nobody holds is a dead process's, and swept away."""
    while True:
        name = folder / f"{TEMPORARY}{secrets.token_hex(8)}"
        handle = os.open(name, os.O_RDWR | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o666)  # umask
        file = os.fdopen(handle, "w+b")
        fcntl.flock(file, fcntl.LOCK_EX)
        if name.exists():
            return name, file
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
