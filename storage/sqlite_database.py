"""A database in a file of SQLite, dumped to a file and loaded from one by its online backup."""

import sqlite3
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar, Literal

from robojackson.errors import BackupFailed

BUSY_S = 10.0
"""Longest wait for SQLite's lock, seconds."""


@dataclass(frozen=True)
class SQLite:
    """The database of a Prefect server that keeps it in a file.

    Attributes:
        path: The file.
    """

    kind: ClassVar[Literal["sqlite"]] = "sqlite"
    path: Path

    @property
    def address(self) -> str:
        """The file, for people."""
        return str(self.path)

    def exists(self) -> bool:
        """Return whether the file is there."""
        return self.path.is_file()

    def is_empty(self) -> bool:
        """Return whether the file is missing or has no table."""
        if not self.exists():
            return True
        with _opened(self.path) as database:
            return bool(database.execute("SELECT count(*) FROM sqlite_master").fetchone() == (0,))

    def dump(self, target: Path) -> None:
        """Write a consistent copy, also while a server writes.

        Raises:
            BackupFailed: the file is damaged or no database.
        """
        with _opened(self.path) as source:
            _copy(source, target)
        with _writable(target) as copy:
            copy.execute("PRAGMA journal_mode = DELETE")  # all in one file

    def require_readable(self, dump: Path) -> None:
        """Raise when a dump is no whole database.

        Raises:
            BackupFailed: SQLite finds it damaged.
        """
        with _opened(dump) as source:
            found = source.execute("PRAGMA integrity_check").fetchone()
        if found != ("ok",):
            raise BackupFailed(f"{dump}: {found[0]}")

    def require_unused(self) -> None:
        """Raise where a server writes to the file.

        Raises:
            BackupFailed: it is locked.
        """
        if self.path.is_file():
            with _writable(self.path) as database:
                database.execute("BEGIN IMMEDIATE")
                database.rollback()

    def load(self, dump: Path) -> None:
        """Replace the content of the file, in one transaction.

        Raises:
            BackupFailed: a server writes to it, or the disk refuses it.
        """
        self.path.parent.mkdir(parents=True, exist_ok=True)
        with _opened(dump) as source:
            _copy(source, self.path)


def _copy(source: sqlite3.Connection, target: Path) -> None:
    """Copy a whole database; Python by itself would wait for a lock without end."""
    end = time.monotonic() + BUSY_S

    def wait(status: int, remaining: int, total: int) -> None:
        if status in (sqlite3.SQLITE_BUSY, sqlite3.SQLITE_LOCKED) and time.monotonic() > end:
            raise sqlite3.OperationalError("the database is locked")

    with _writable(target) as database:
        source.backup(database, progress=wait)


@contextmanager
def _opened(path: Path) -> Iterator[sqlite3.Connection]:
    """Yield a connection that only reads."""
    with _named(path), closing(_connect(f"{path.absolute().as_uri()}?mode=ro")) as database:
        yield database


@contextmanager
def _writable(path: Path) -> Iterator[sqlite3.Connection]:
    with _named(path), closing(_connect(path.absolute().as_uri())) as database:
        yield database


def _connect(uri: str) -> sqlite3.Connection:
    return sqlite3.connect(uri, uri=True, timeout=BUSY_S)


@contextmanager
def _named(path: Path) -> Iterator[None]:
    """Name the file in SQLite's errors."""
    try:
        yield
    except sqlite3.Error as cause:
        advice = "; stop the Prefect server that uses it" if "locked" in str(cause) else ""
        raise BackupFailed(f"{path}: {cause}{advice}") from cause
