"""A database of a PostgreSQL server, dumped to a file and loaded from one by PostgreSQL's programs.

Passwords reach pg_dump, pg_restore and psql by their environment, never by their command line.
"""

import os
import subprocess
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import ClassVar, Literal
from urllib.parse import SplitResult, parse_qs, unquote, urlsplit

from robojackson.errors import BackupFailed, MissingDependency

CONNECTION_URL = "PREFECT_SERVER_DATABASE_CONNECTION_URL"
"""The variable that names the database of a Prefect server."""
TABLES = (
    "SELECT count(*) FROM information_schema.tables WHERE table_schema NOT IN "
    "('pg_catalog', 'information_schema')"
)
USERS = (
    "SELECT count(*) FROM pg_stat_activity WHERE datname = current_database() "
    "AND backend_type = 'client backend' AND pid <> pg_backend_pid()"
)
CONNECT_S = 10
"""Longest wait for a connection, seconds."""
_OF_NO_ROLE = ("--no-owner", "--no-privileges")


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
        """Return the database of a URL as SQLAlchemy takes it.

        Raises:
            BackupFailed: it is no address; the message does not have the password.
        """
        parts = _parts(url)
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

    def require_unused(self) -> None:
        """Raise where a Prefect server uses the database.

        Raises:
            BackupFailed: it has other connections.
        """
        if users := self._count(USERS):
            raise BackupFailed(
                f"{self.address}: {users} connections use the database; stop the Prefect server"
            )

    def load(self, dump: Path) -> None:
        """Replace the tables by those of a dump, in one transaction.

        Raises:
            BackupFailed: a Prefect server uses the database, or it refuses the dump; nothing is
                changed.
        """
        self.require_unused()
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


def _parts(url: str) -> SplitResult:
    """Return the parts of an address, of which the port has to be a number."""
    try:
        parts = urlsplit(url)
        parts.port  # noqa: B018 (raises for a port that is none)
    except ValueError:
        raise BackupFailed(
            f"{CONNECTION_URL} is no address postgresql+asyncpg://USER:PASSWORD@HOST:PORT/NAME; in "
            "a user or password write / as %2F, # as %23, ? as %3F, [ as %5B, @ as %40"
        ) from None  # the cause holds a part of the password
    return parts


def _advice(message: str) -> str:
    """Return the next step for the failures that a user can repair."""
    if "version mismatch" in message or "unsupported version" in message:
        return "; install the postgresql-client of the server's version"
    if "authentication failed" in message or "no password supplied" in message:
        return f"; correct the user and password of {CONNECTION_URL}"
    return ""
