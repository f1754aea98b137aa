"""Prefect's database, dumped to a file and loaded from one: PostgreSQL by its own programs, SQLite
by its online backup.

Passwords reach pg_dump, pg_restore and psql by their environment, never by their command line.
"""

import os
import sqlite3
import subprocess
import time
from collections.abc import Iterator, Mapping
from contextlib import closing, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import ClassVar, Literal, Protocol
from urllib.parse import parse_qs, unquote, urlsplit

from robojackson.errors import BackupFailed, MissingDependency

VARIABLES = (
    "PREFECT_SERVER_DATABASE_CONNECTION_URL",
    "PREFECT_API_DATABASE_CONNECTION_URL",  # its name before Prefect 3.1
)
SQLITE_FILE = "prefect.db"
"""Name of Prefect's database in its home, where no variable names another."""
TABLES = (
    "SELECT count(*) FROM information_schema.tables WHERE table_schema NOT IN "
    "('pg_catalog', 'information_schema')"
)
USERS = (
    "SELECT count(*) FROM pg_stat_activity WHERE datname = current_database() "
    "AND backend_type = 'client backend' AND pid <> pg_backend_pid()"
)
CONNECT_S, BUSY_S = 10, 10.0
"""Longest waits: for a connection to PostgreSQL, for SQLite's lock."""


class Database(Protocol):
    """What a backup needs of a database."""

    @property
    def kind(self) -> Literal["postgresql", "sqlite"]:
        """Which database it is."""

    @property
    def address(self) -> str:
        """Where it is, for people."""

    def exists(self) -> bool:
        """Return whether there is a database to dump."""

    def is_empty(self) -> bool:
        """Return whether loading a dump replaces nothing."""

    def dump(self, target: Path) -> None:
        """Write a consistent copy to a file."""

    def require_readable(self, dump: Path) -> None:
        """Raise when a dump cannot be loaded."""

    def load(self, dump: Path) -> None:
        """Replace what is in the database by a dump, all of it or nothing."""


def database_of(environment: Mapping[str, str], home: Path) -> Database:
    """Return the database of a Prefect server with this environment.

    Args:
        home: Prefect's home, which has the database when no variable names one.
    Raises:
        BackupFailed: a variable names one that cannot be copied.
    """
    name = next((name for name in VARIABLES if environment.get(name)), None)
    if name is None:
        return SQLite(home / SQLITE_FILE)
    url = environment[name]
    scheme = url.partition("://")[0].partition("+")[0]
    if scheme in ("postgresql", "postgres"):
        return PostgreSQL.of(url)
    path = unquote(urlsplit(url).path)
    if scheme == "sqlite" and path and ":memory:" not in url:
        return SQLite(Path(path.removeprefix("/")))
    raise BackupFailed(
        f"{name}={url.partition('://')[0]}://... names no database that can be copied: "
        "postgresql+asyncpg://USER:PASSWORD@HOST:PORT/NAME or sqlite+aiosqlite:////PATH"
    )


@dataclass(frozen=True)
class PostgreSQL:
    """A database of a PostgreSQL server.

    Attributes:
        address: Host, port and name, for people.
        access: Environment of PostgreSQL's programs that reaches it, password included.
    """

    kind: ClassVar[Literal["postgresql"]] = "postgresql"
    address: str
    access: Mapping[str, str] = field(repr=False)

    @classmethod
    def of(cls, url: str) -> "PostgreSQL":
        """Return the database of a URL as SQLAlchemy takes it."""
        parts = urlsplit(url)
        options = {key: values[-1] for key, values in parse_qs(parts.query).items()}
        access = {
            "PGHOST": options.get("host") or parts.hostname or "localhost",
            "PGPORT": str(options.get("port") or parts.port or 5432),
            "PGUSER": unquote(parts.username or options.get("user", "")),
            "PGPASSWORD": unquote(parts.password or options.get("password", "")),
            "PGDATABASE": unquote(parts.path.lstrip("/")),
            "PGSSLMODE": options.get("sslmode") or options.get("ssl") or "prefer",
            "PGCONNECT_TIMEOUT": str(CONNECT_S),
            "LC_ALL": "C",
        }
        address = "{PGHOST}:{PGPORT}/{PGDATABASE}".format(**access)
        return cls(address, {name: value for name, value in access.items() if value})

    def exists(self) -> bool:
        """Return whether it has tables.

        Raises:
            BackupFailed: the server does not answer, or refuses the password.
        """
        return not self.is_empty()

    def is_empty(self) -> bool:
        """Return whether it has no table.

        Raises:
            BackupFailed: the server does not answer, or refuses the password.
        """
        return self._count(TABLES) == 0

    def dump(self, target: Path) -> None:
        """Write a dump in PostgreSQL's custom format.

        Raises:
            BackupFailed: no answer, a wrong password, or a server that is newer than pg_dump.
        """
        self._run("pg_dump", "--format=custom", *_OF_NO_ROLE, "--file", str(target))

    def require_readable(self, dump: Path) -> None:
        """Raise when pg_restore cannot read a dump.

        Raises:
            BackupFailed: it is damaged, or of a newer pg_dump.
        """
        self._run("pg_restore", "--list", str(dump), server=False)

    def load(self, dump: Path) -> None:
        """Replace the tables by those of a dump, in one transaction.

        Raises:
            BackupFailed: a Prefect server uses the database, or it refuses the dump; nothing is
                changed.
        """
        if users := self._count(USERS):
            raise BackupFailed(
                f"{self.address}: {users} connections use the database; stop the Prefect server"
            )
        replace = ("--clean", "--if-exists", "--single-transaction", *_OF_NO_ROLE)
        self._run("pg_restore", *replace, "--dbname", self.access["PGDATABASE"], str(dump))

    def _count(self, question: str) -> int:
        words = ("--no-psqlrc", "--tuples-only", "--command", question)
        return int(self._run("psql", *words).strip())

    def _run(self, program: str, *words: str, server: bool = True) -> str:
        """Run one of PostgreSQL's programs; return what it prints."""
        command = [program, *(("--no-password",) if server else ()), *words]
        given = {**os.environ, **self.access}
        try:
            run = subprocess.run(command, env=given, capture_output=True, text=True, check=False)
        except FileNotFoundError as cause:
            raise MissingDependency(
                f"{program} is not installed: apt-get install postgresql-client"
            ) from cause
        if run.returncode:
            lines = " ".join(run.stderr.split()) or f"exit code {run.returncode}"
            raise BackupFailed(f"{self.address}: {lines}{_advice(lines)}")
        return run.stdout


_OF_NO_ROLE = ("--no-owner", "--no-privileges")


def _advice(message: str) -> str:
    """Return the next step for the failures that a user can mend."""
    if "version mismatch" in message or "unsupported version" in message:
        return "; install the postgresql-client of the server's version"
    if "authentication failed" in message or "no password supplied" in message:
        return f"; correct the user and password of {VARIABLES[0]}"
    return ""


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
            return database.execute("SELECT count(*) FROM sqlite_master").fetchone() == (0,)

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
