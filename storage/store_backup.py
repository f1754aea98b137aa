"""A store and Prefect's database into a folder of backups; the way back is `store_restore`.

The database is dumped before the store is copied: the store only grows, so every artifact that the
database names is in the copy.
"""

import shutil
from dataclasses import dataclass

import fsspec

from robojackson.errors import BackupFailed
from robojackson.files.file_tree import in_one_line
from robojackson.files.local_folder import LocalFolder
from robojackson.files.places import Remote
from storage.backup import Backups, Content, Dump, Manifest
from storage.backup_progress import Progress, Report, each_finished, megabytes
from storage.prefect_database import Database
from storage.store import Store
from storage.store_listing import entries, key_of

NO_FILES: dict[str, Content] = {}


@dataclass(frozen=True)
class BackupResult:
    """Result of a backup.

    Attributes:
        name: Name of the backup.
        files, size_mb: Files and size in it.
        copied, copied_mb: Files and millions of bytes that earlier backups did not have.
        database: Address of the database that was dumped; None: there is none.
        freed_mb: Size of contents that were in removed backups alone, MB.
    """

    name: str
    files: int
    size_mb: float
    copied: int
    copied_mb: float
    database: str | None
    freed_mb: float


def back_up(
    store: Store, database: Database, backups: Backups, keep: int, report: Report
) -> BackupResult:
    """Add a backup to a folder; contents that are there already are not copied again.

    Args:
        keep: How many backups stay, this one included.
        report: Called after every file.
    Raises:
        BackupFailed: nothing is there, something cannot be read, or the folder is in the store.
    """
    _require_apart(store, backups)
    if not database.exists() and not entries(store, database, without=backups.root):
        raise BackupFailed(
            f"nothing to back up: no file in {store.root}, no database at {database.address}"
        )
    with backups.held():
        before = _newest(backups)
        dump = _dumped(database, backups)
        found = entries(store, database, without=backups.root)
        progress = Progress("copied", len(found))

        def one(key: str) -> Content | None:
            content = before.get(key)
            if content and content.stamp == found[key] is not None and backups.has(content):
                return content
            return _copied(store, key, found[key], backups)

        files: dict[str, Content] = {}
        known = {content.sha256 for content in before.values()}
        for key, content in each_finished(one, found):
            progress.done += 1
            if content is not None:  # else removed since it was listed
                files[key] = content
                progress.copied += 0 if content.sha256 in known else content.size
            report(progress)
        manifest = Manifest(store.root, dict(sorted(files.items())), dump)
        name = backups.write(manifest)
        new = [c for c in files.values() if c.sha256 not in known]
        return BackupResult(
            name=name,
            files=len(files),
            size_mb=megabytes(files.values()),
            copied=len(new),
            copied_mb=megabytes(new),
            database=database.address if dump else None,
            freed_mb=backups.prune(keep) / 1e6,
        )


def _require_apart(store: Store, backups: Backups) -> None:
    places = (backups.root, backups.root.resolve())
    if any(key_of(store, place) is not None for place in places):
        raise BackupFailed(f"{backups.root} is in the store {store.root}; choose another folder")


def _newest(backups: Backups) -> dict[str, Content]:
    """Return the files of the newest backup; none where its manifest is damaged."""
    try:
        return backups.read().files
    except BackupFailed:
        return NO_FILES


def _dumped(database: Database, backups: Backups) -> Dump | None:
    if not database.exists():
        return None
    with backups.temporary() as path:
        database.dump(path)
        return Dump(database.kind, backups.add(path))


def _copied(store: Store, key: str, stamp: str | None, backups: Backups) -> Content | None:
    """Copy a file of the store; None when it is gone."""
    what = f"cannot copy {store.address(key)}"
    with backups.temporary() as path, in_one_line(what, BackupFailed):
        try:
            if isinstance(store.place, LocalFolder):
                shutil.copyfile(store.place.root / key, path)
            else:
                assert isinstance(store.place, Remote)
                system, base = fsspec.core.url_to_fs(store.place.url)
                system.get_file(f"{base}/{key}", str(path))
        except FileNotFoundError:
            return None
        return backups.add(path, stamp)
