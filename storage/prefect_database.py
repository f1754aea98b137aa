"""The database of a Prefect server, as a backup dumps and loads it: in PostgreSQL or in SQLite."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Literal, Protocol
from urllib.parse import unquote, urlsplit

from robojackson.errors import BackupFailed
from storage.postgresql_database import CONNECTION_URL, PostgreSQL
from storage.sqlite_database import SQLite

VARIABLES = (
    CONNECTION_URL,
    "PREFECT_API_DATABASE_CONNECTION_URL",  # its name before Prefect 3.1
)
SQLITE_FILE = "prefect.db"
"""Name of Prefect's database in its home, where no variable names another."""


class Database(Protocol):
    """Interface of a database for backups."""

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

    def require_unused(self) -> None:
        """Raise where a Prefect server uses the database, so that a dump cannot be loaded."""

    def load(self, dump: Path) -> None:
        """Replace what is in the database by a dump, all of it or nothing."""


def database_of(environment: Mapping[str, str], home: Callable[[], Path]) -> Database:
    """Return the database of a Prefect server with this environment.

    Args:
        home: Called for Prefect's home, which has the database when no variable names one.
    Raises:
        BackupFailed: a variable names one that cannot be copied.
    """
    name = next((name for name in VARIABLES if environment.get(name)), None)
    if name is None:
        return SQLite(home() / SQLITE_FILE)
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
