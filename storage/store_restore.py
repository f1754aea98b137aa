"""A backup into a store and Prefect's database, verified before anything is written.

The store comes first: so every artifact that the database names is there when the database is.
"""

from collections.abc import Iterable
from dataclasses import dataclass

from robojackson.errors import BackupFailed
from storage.backup import Backups, Manifest
from storage.backup_progress import Progress, Report, each_finished, megabytes
from storage.prefect_database import Database
from storage.store import Store
from storage.store_listing import entries


@dataclass(frozen=True)
class Restored:
    """Result of a restore.

    Attributes:
        files, size_mb: Files and size that were written.
        database: Address of the database that was loaded; None: the backup has none.
        others: Files of the store that the backup does not have; they stay.
    """

    files: int
    size_mb: float
    database: str | None
    others: int


def restore(
    store: Store,
    database: Database,
    backups: Backups,
    report: Report,
    name: str | None = None,
    force: bool = False,
) -> Restored:
    """Write a backup into a store and a database.

    Args:
        report: Called after every file.
        name: Name of the backup; the newest without one.
        force: Replace what is in a store and a database that are not empty.
    Raises:
        BackupFailed: the backup is damaged, or the target is not empty or in use; nothing is
            written.
    """
    manifest = backups.read(name)
    dump = manifest.database
    if dump is not None and dump.kind != database.kind:
        raise BackupFailed(
            f"the backup holds a {dump.kind} database, the target is {database.kind} "
            f"({database.address}); PREFECT_SERVER_DATABASE_CONNECTION_URL decides"
        )
    held = entries(store, database, may_be_missing=True)
    if not force:
        _require_empty(store, held, database if dump else None)
    _verify(backups, manifest, report)
    if dump is not None:
        database.require_readable(backups.path(dump.content))
        database.require_unused()
    store.create()
    progress = Progress("restored", len(manifest.files))

    def one(key: str) -> None:
        store.put(key, backups.path(manifest.files[key]))

    for key, _ in each_finished(one, manifest.files):
        progress.done += 1
        progress.copied += manifest.files[key].size
        report(progress)
    if dump is not None:
        database.load(backups.path(dump.content))
    return Restored(
        files=len(manifest.files),
        size_mb=megabytes(manifest.files.values()),
        database=database.address if dump else None,
        others=len(held.keys() - manifest.files.keys()),
    )


def _require_empty(store: Store, held: Iterable[str], database: Database | None) -> None:
    some = next(iter(held), None)
    if some is not None:
        raise BackupFailed(
            f"the store {store.root} is not empty (it has {some}); --force replaces files of the "
            "same names and leaves the others"
        )
    if database is not None and not database.is_empty():
        raise BackupFailed(
            f"the database {database.address} is not empty; --force replaces what is in it"
        )


def _verify(backups: Backups, manifest: Manifest, report: Report) -> None:
    """Raise when any content of a backup is missing, truncated or altered."""
    named = {content.sha256: key for key, content in manifest.files.items()}
    contents = manifest.contents()
    progress = Progress("verified", len(contents))

    def one(sha256: str) -> None:
        backups.require_whole(contents[sha256], named.get(sha256, "the database"))

    for sha256, _ in each_finished(one, contents):
        progress.done += 1
        progress.copied += contents[sha256].size
        report(progress)
