"""The commands `backup` and `restore`."""

import os
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from robojackson.cli.console import CommandResult, command, ticker
from robojackson.cli.options import Json

if TYPE_CHECKING:
    from storage.prefect_database import Database
    from storage.store import Store

EVERY_S = 1.0
"""Between two lines of progress."""


def _named(text: str) -> Path:
    """Return the folder that a word names.

    Raises:
        BadParameter: the word is empty, as where a shell's variable is not set, or names a file.
    """
    if not text:
        raise typer.BadParameter("the folder's name is empty; `.` is the current one")
    if Path(text).is_file():
        raise typer.BadParameter(f"{text} is a file; name a folder")
    return Path(text)


FolderOfBackups = Annotated[
    Path, typer.Argument(parser=_named, metavar="FOLDER", help="Folder of the backups.")
]


@command
def backup(
    folder: FolderOfBackups,
    keep: Annotated[int, typer.Option(min=1, help="How many backups stay in the folder.")] = 7,
    as_json: Json = False,
) -> CommandResult:
    """Copy the store and Prefect's database into a folder; only what is new is copied."""
    from storage.backup import Backups
    from storage.store_backup import back_up

    store, database = _source()
    _require_known(database)
    with _progress() as report:
        made = back_up(store, database, Backups(folder), keep, report)
    text = [
        f"backup    {made.name} in {folder}",
        f"store     {made.files:,} files, {made.size_mb:,.1f} MB of {store.root}; "
        f"{made.copied:,} files, {made.copied_mb:,.1f} MB copied",
        f"database  {made.database or f'none at {database.address}'}",
    ]
    return CommandResult(asdict(made), text=text)


@command
def restore(
    folder: FolderOfBackups,
    at: Annotated[str | None, typer.Option(help="Name of the backup; the newest without.")] = None,
    force: Annotated[
        bool, typer.Option("--force", help="Replace what is in a store and database in use.")
    ] = False,
    as_json: Json = False,
) -> CommandResult:
    """Verify a backup, then write it into an empty store and an empty database."""
    from storage.backup import Backups
    from storage.store_restore import restore as write

    store, database = _source()
    with _progress() as report:
        made = write(store, database, Backups(folder), report, at, force)
    text = [
        f"store     {made.files:,} files, {made.size_mb:,.1f} MB in {store.root}",
        f"database  {made.database or 'none in the backup'}",
    ]
    if made.others:
        text.append(f"others    {made.others:,} files that the backup does not have stay")
    return CommandResult(asdict(made), text=text)


def _source() -> tuple["Store", "Database"]:
    """Return the store and the database that the environment names."""
    from flows.runtime.environment import HOME
    from storage.prefect_database import database_of
    from storage.store import Store

    store = Store.from_environment()

    def home() -> Path:
        named = os.environ.get("PREFECT_HOME")
        return Path(named).expanduser() if named else store.here / HOME

    return store, database_of(os.environ, home)


def _require_known(database: "Database") -> None:
    """Raise when the server that the environment names keeps its database elsewhere.

    Raises:
        BackupFailed: the copy would silently be one without a database.
    """
    from robojackson.errors import BackupFailed
    from storage.prefect_database import VARIABLES

    named = any(os.environ.get(name) for name in VARIABLES)
    if os.environ.get("PREFECT_API_URL") and not named and not database.exists():
        raise BackupFailed(
            f"the database of the server of PREFECT_API_URL is not {database.address}; set "
            f"{VARIABLES[0]}, or unset PREFECT_API_URL to copy the store alone"
        )


@contextmanager
def _progress() -> Iterator[Callable[[object], None]]:
    """Yield what shows progress on stderr, at most once a second."""
    last = time.monotonic()
    with ticker() as tell:

        def report(progress: object) -> None:
            nonlocal last
            if time.monotonic() - last >= EVERY_S:
                last = time.monotonic()
                tell(str(progress))

        yield report
