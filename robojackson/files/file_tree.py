"""Files by key under one root; every failure is one line that names the file.

Commands write their results through it; the store of the flows is a `FileTree` at any address.
"""

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from robojackson.errors import RoboJacksonError, StoreError
from robojackson.files.local_folder import (
    TEMPORARY,
    LocalFolder,
    Place,
    sha256_of,
    sha256_of_file,
)


class FileTree:
    """Files by key, `/` between the parts of a key.

    Attributes:
        root: Path or address, as given.
        place: The folder or other storage that holds the files.
    """

    def __init__(self, root: str | Path, place: Place | None = None) -> None:
        self.root = str(root)
        with in_one_line(f"cannot open the store {self.root}"):
            self.place: Place = place or LocalFolder(Path(root))

    def write(self, key: str, content: bytes | Path) -> str:
        """Write bytes, or copy a local file, under a key, replacing a file; return its sha256.

        Raises:
            StoreError: full disk, no permission, connection cut, a device in its place, or a name
                that is no UTF-8; nothing half-written is left.
        """
        if not _is_text(key):
            raise StoreError(f"cannot write {key!a}: the name is no UTF-8; choose another")
        with in_one_line(f"cannot write {self.address(key)}"):
            digest = digest_of(content)
            self.place.put(key, content)
        return digest

    def read(self, key: str) -> bytes:
        """Return the content of a file."""
        with in_one_line(f"cannot read {self.address(key)}"):
            return self.place.read(key)

    def sha256(self, key: str) -> str:
        """Return the digest of a file's content."""
        with in_one_line(f"cannot read {self.address(key)}"):
            return self.place.sha256(key)

    def exists(self, key: str) -> bool:
        """Return whether a file exists under the key."""
        with in_one_line(f"cannot look at {self.address(key)}"):
            return self.place.exists(key)

    def remove(self, key: str) -> None:
        """Remove a file; a missing file is no error."""
        with in_one_line(f"cannot remove {self.address(key)}"):
            try:
                self.place.remove(key)
            except FileNotFoundError:
                return

    def list(self, prefix: str = "") -> list[str]:
        """Return the sorted keys under a folder."""
        with in_one_line(f"cannot list {self.address(prefix)}"):
            return sorted(self.place.list(prefix))

    def address(self, key: str) -> str:
        """Return the path or URL of a key, for messages."""
        return self.place.address(key)

    def require_writable(self) -> None:
        """Raise a one-line error where the place is full or refuses a write, before any work."""
        self._try_to_write(f"the folder {self.root}")

    def _try_to_write(self, named: str) -> None:
        key = f"{TEMPORARY}{os.getpid()}"
        with in_one_line(f"cannot write {named}"):
            self.place.put(key, b"robojackson " * 1024)
            self.place.remove(key)


def digest_of(content: bytes | Path) -> str:
    """Return the digest of bytes, or of a local file, in hexadecimal."""
    return sha256_of(content) if isinstance(content, bytes) else sha256_of_file(content)


@contextmanager
def in_one_line(what: str, error: type[RoboJacksonError] = StoreError) -> Iterator[None]:
    """Turn any exception of a place into a one-line error.

    Args:
        what: The operation that failed; the line begins with it.
        error: Class of the error that is raised; an error of ours passes unchanged.
    """
    try:
        yield
    except RoboJacksonError:
        raise
    except Exception as cause:
        reason = cause.strerror if isinstance(cause, OSError) and cause.strerror else str(cause)
        line = " ".join(reason.split()) or type(cause).__name__
        raise error(f"{what}: {line}") from cause


@contextmanager
def without_empty_folders(out: Path) -> Iterator[None]:
    """Remove the empty folders that were made for results when the command fails."""
    missing = [path for path in (out, *out.parents) if not path.exists()]
    try:
        yield
    except BaseException:
        with suppress(OSError):
            for path in missing:
                path.rmdir()
        raise


@contextmanager
def results_in(out: Path) -> Iterator[FileTree]:
    """Yield a folder for results; raise at once where it cannot be written.

    The folder is created with the first result, so that a command without results leaves nothing.
    """
    there = next(path for path in (out.absolute(), *out.absolute().parents) if path.exists())
    FileTree(there).require_writable()
    yield FileTree(out)


def _is_text(key: str) -> bool:
    """Return whether a name can be printed; a file system takes any bytes."""
    try:
        key.encode()
    except UnicodeEncodeError:
        return False
    return True
