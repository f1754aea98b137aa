"""A folder on a disk whose files are written whole or not at all.

A write goes to a temporary name, is flushed to the disk and then renamed. Errors are those of the
operating system; `file_tree.FileTree` turns them into messages.
"""

import fcntl
import hashlib
import os
import secrets
import shutil
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any, Protocol

CHUNK = 1 << 20
TEMPORARY = ".part-"
"""Prefix of the names of files that are being written."""
OF_THE_DISK = "lost+found"
"""Folder of a file system at its root, which only its administrator may read."""
FILE = "file://"
"""Before the path of a folder that is given as a URL."""


def folder_of(root: str) -> Path | None:
    """Return the folder of this machine that an address names: a path, or `file://` before one;
    None for any other URL."""
    if "://" in root and not root.startswith(FILE):
        return None
    return Path(root.removeprefix(FILE))


def user_cache() -> Path:
    """Return our folder in the user's cache.

    Raises:
        RuntimeError: the user has no home.
    """
    root = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(root) / "robojackson"


def cache_of(root: str) -> Path:
    """Return the folder in the user's cache of a store that is no folder of this machine: what one
    store has is never taken for another's.

    Raises:
        RuntimeError: the user has no home.
    """
    return user_cache() / sha256_of(root.encode())[:12]


class Place(Protocol):
    """Interface of a place that keeps files; keys are relative, `/` between their parts."""

    def create(self) -> None:
        """Create the place itself (a folder, a bucket) if it does not exist."""

    def put(self, key: str, source: Path | bytes) -> None:
        """Write a whole file or nothing."""

    def read(self, key: str) -> bytes:
        """Return the content of a file."""

    def sha256(self, key: str) -> str:
        """Return the digest of a file's content."""

    def exists(self, key: str) -> bool:
        """Return whether the file exists."""

    def remove(self, key: str) -> None:
        """Remove a file."""

    def list(self, prefix: str) -> list[str]:
        """Return the keys of the files under a folder."""

    def address(self, key: str) -> str:
        """Return the name of a file for messages."""


class LocalFolder:
    """A folder on a disk."""

    def __init__(self, root: Path) -> None:
        self.root = root.absolute()
        if self.root.is_file():
            raise NotADirectoryError("a file; expected a folder")

    def create(self) -> None:
        """Create the folder and its parents."""
        self.root.mkdir(parents=True, exist_ok=True)

    def put(self, key: str, source: Path | bytes) -> None:
        """Write a file under a temporary name, flush it to the disk, and rename it."""
        target = (self.root / key).resolve()  # a link stays one
        if target.is_dir():
            raise IsADirectoryError("a folder; name a file in it")
        if target.exists() and not target.is_file():
            raise OSError("a device or a pipe; name a file")
        mode = target.stat().st_mode & 0o777 if target.exists() else None
        target.parent.mkdir(parents=True, exist_ok=True)
        name, file = _open_temporary(target.parent)
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
        """Return the content of a file."""
        return (self.root / key).read_bytes()

    def sha256(self, key: str) -> str:
        """Return the digest of a file's content."""
        return sha256_of_file(self.root / key)

    def exists(self, key: str) -> bool:
        """Return whether the file exists."""
        return (self.root / key).is_file()

    def remove(self, key: str) -> None:
        """Remove a file; a missing file is no error."""
        (self.root / key).unlink(missing_ok=True)

    def list(self, prefix: str) -> list[str]:
        """Return the keys of the files under a folder, without temporary files."""
        found = (path for path in files_in(self.root / prefix) if TEMPORARY not in path.name)
        return [path.relative_to(self.root).as_posix() for path in found]

    def address(self, key: str) -> str:
        """Return the path of a file."""
        return str(self.root / key)


def files_in(folder: Path, without: Path | None = None) -> Iterator[Path]:
    """Yield the files under a folder, in linked folders too, but for those that lead back; what
    goes away meanwhile is left out.

    Args:
        without: A folder that is left out wherever it turns up.
    Raises:
        PermissionError: a folder may not be read; the message names it.
    """
    yield from _files_in(folder, tuple(_identities(folder, *([without] if without else []))))


def _files_in(folder: Path, left_out: tuple[tuple[int, int], ...]) -> Iterator[Path]:
    try:
        inner = sorted(folder.iterdir())
    except (FileNotFoundError, NotADirectoryError):
        return
    except PermissionError as cause:
        if folder.name == OF_THE_DISK:
            return
        raise PermissionError(cause.errno, f"{cause.strerror}: {folder}") from cause
    for path in inner:
        if path.is_file():
            yield path
        elif path.is_dir():
            own = tuple(_identities(path))
            if own and own[0] not in left_out:
                yield from _files_in(path, (*left_out, *own))


def _identities(*folders: Path) -> Iterator[tuple[int, int]]:
    """Yield what is the same for every path of a folder, of those that there are."""
    for folder in folders:
        with suppress(FileNotFoundError):
            facts = folder.stat()
            yield facts.st_dev, facts.st_ino


def sha256_of(data: bytes) -> str:
    """Return the digest of bytes, in hexadecimal."""
    return hashlib.sha256(data).hexdigest()


def sha256_of_file(path: Path) -> str:
    """Return the digest of a local file, in hexadecimal; raise for a device, which has no end."""
    if path.exists() and not path.is_file() and not path.is_dir():
        raise OSError("a device or a pipe, not a file")
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _open_temporary(folder: Path) -> tuple[Path, Any]:
    """Open a temporary file and lock it; one without a lock belongs to a dead process."""
    while True:
        name = folder / f"{TEMPORARY}{secrets.token_hex(8)}"
        handle = os.open(name, os.O_RDWR | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o666)  # umask
        file = os.fdopen(handle, "w+b")
        fcntl.flock(file, fcntl.LOCK_EX)
        if name.exists():
            return name, file
        file.close()  # another process removed it before it was locked


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
