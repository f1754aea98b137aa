"""A store and Prefect's database into a folder of backups, and back.

The database is dumped before the store is copied: the store only grows, so every artifact that the
database names is in the copy. On the way back the store comes first for the same reason.
"""

import os
import shutil
import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

import fsspec

from robojackson.errors import BackupFailed
from robojackson.pipeline.file_tree import in_one_line
from robojackson.pipeline.local_folder import TEMPORARY, LocalFolder
from storage.backup import Backups, Content, Dump, Manifest
from storage.places import Remote
from storage.prefect_database import Database, SQLite
from storage.store import Store

WORK = "work/"
"""Folder of unfinished trainings and scratch files: they belong to processes of one machine."""
LIVE = "prefect/prefect.db"
"""Prefect's own database and its journals in a local store: dumped, not copied."""
THREADS = 8
RECENT_S = 2.0
"""A file changed so recently may change again without a newer time."""

T = TypeVar("T")
NO_FILES: dict[str, Content] = {}


@dataclass
class Progress:
    """How far a copy is.

    Attributes:
        what: What is done to each file.
        total: Files.
        done: Files that are finished, unchanged ones too.
        copied: Bytes that were read or written.
    """

    what: str
    total: int
    done: int = 0
    copied: int = 0
    began: float = field(default_factory=time.monotonic)

    def __str__(self) -> str:
        seconds = max(time.monotonic() - self.began, 1e-3)
        rate = self.copied / 1e6 / seconds
        return (
            f"{self.what} {self.done:,} of {self.total:,} files, {self.copied / 1e6:,.1f} MB, "
            f"{rate:,.1f} MB/s"
        )


Report = Callable[[Progress], None]


@dataclass(frozen=True)
class BackupResult:
    """What a backup did.

    Attributes:
        name: Of the backup.
        files, size_mb: In it.
        copied, copied_mb: Files and millions of bytes that earlier backups did not have.
        database: Address of the database that was dumped; None: there is none.
        freed_mb: Of contents that only removed backups had.
    """

    name: str
    files: int
    size_mb: float
    copied: int
    copied_mb: float
    database: str | None
    freed_mb: float


@dataclass(frozen=True)
class Restored:
    """What a restore did.

    Attributes:
        files, size_mb: That were written.
        database: Address of the database that was loaded; None: the backup has none.
        others: Files of the store that the backup does not have; they stay.
    """

    files: int
    size_mb: float
    database: str | None
    others: int


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
    with backups.held():
        before = _newest(backups)
        dump = _dumped(database, backups)
        found = entries(store, database)
        if not found and dump is None:
            raise BackupFailed(
                f"nothing to back up: no file in {store.root}, no database at {database.address}"
            )
        progress = Progress("copied", len(found))

        def one(key: str) -> Content | None:
            content = before.get(key)
            if content and content.stamp == found[key] is not None and backups.has(content):
                return content
            return _copied(store, key, found[key], backups)

        files: dict[str, Content] = {}
        known = {content.sha256 for content in before.values()}
        for key, content in _each(one, found):
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
            size_mb=_mb(files.values()),
            copied=len(new),
            copied_mb=_mb(new),
            database=database.address if dump else None,
            freed_mb=backups.prune(keep) / 1e6,
        )


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
        name: Of the backup; the newest without one.
        force: Replace what is in a store and a database that are not empty.
    Raises:
        BackupFailed: the backup is damaged or the target is not empty; nothing is written.
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
    store.create()
    progress = Progress("restored", len(manifest.files))

    def one(key: str) -> None:
        store.put(key, backups.path(manifest.files[key]))

    for key, _ in _each(one, manifest.files):
        progress.done += 1
        progress.copied += manifest.files[key].size
        report(progress)
    if dump is not None:
        database.load(backups.path(dump.content))
    return Restored(
        files=len(manifest.files),
        size_mb=_mb(manifest.files.values()),
        database=database.address if dump else None,
        others=len(held.keys() - manifest.files.keys()),
    )


def entries(
    store: Store, database: Database, may_be_missing: bool = False
) -> dict[str, str | None]:
    """Return the files of a store that a backup has, each with its stamp.

    Args:
        may_be_missing: A folder or bucket that does not exist counts as empty.
    Raises:
        BackupFailed: the store cannot be listed, or a name in it is no UTF-8.
    """
    with in_one_line(f"cannot list {store.root}", BackupFailed):
        try:
            found = _found(store)
        except FileNotFoundError:
            if not may_be_missing:
                raise
            found = {}
    own = _inside(store, database.path) if isinstance(database, SQLite) else None
    chosen = {}
    for key, stamp in found.items():
        if key.startswith((WORK, LIVE)) or (own and key.startswith(own)):
            continue
        if not key.isascii() and key != key.encode(errors="replace").decode():
            raise BackupFailed(f"{store.address(key)!a}: the name is no UTF-8; rename the file")
        chosen[key] = stamp
    return chosen


def _found(store: Store) -> dict[str, str | None]:
    if isinstance(store.place, LocalFolder):
        return _local(store.place.root)
    assert isinstance(store.place, Remote)
    return _remote(store.place.url)


def _local(root: Path) -> dict[str, str | None]:
    """Return the files of a folder, with what changes whenever one is written."""
    found: dict[str, str | None] = {}
    os.stat(root)  # os.walk finds a folder that does not exist empty
    for folder, _, names in os.walk(root):
        for path in (Path(folder, name) for name in names if TEMPORARY not in name):
            try:
                facts = path.stat()
            except FileNotFoundError:
                continue
            if not path.is_file():
                continue
            recent = time.time() - facts.st_ctime < RECENT_S
            stamp = f"{facts.st_ino}-{facts.st_size}-{facts.st_mtime_ns}-{facts.st_ctime_ns}"
            found[path.relative_to(root).as_posix()] = None if recent else stamp
    return found


def _remote(url: str) -> dict[str, str | None]:
    """Return the files under a URL, with the tag that object stores derive from the content."""
    system, base = fsspec.core.url_to_fs(url)
    system.invalidate_cache()
    facts: dict[str, Any] = system.find(base, detail=True)
    found: dict[str, str | None] = {}
    for path, info in facts.items():
        tag = info.get("ETag") or info.get("etag")
        if TEMPORARY not in path:
            key = path.removeprefix(base).lstrip("/")
            found[key] = f"{tag}-{info['size']}" if tag else None
    return found


def _inside(store: Store, path: Path) -> str | None:
    """Return the key of a path in a local store; None elsewhere."""
    if isinstance(store.place, LocalFolder) and path.absolute().is_relative_to(store.place.root):
        return path.absolute().relative_to(store.place.root).as_posix()
    return None


def _require_apart(store: Store, backups: Backups) -> None:
    if _inside(store, backups.root) is not None:
        raise BackupFailed(f"{backups.root} is in the store {store.root}; choose another folder")


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


def _verify(backups: Backups, manifest: Manifest, report: Report) -> None:
    """Raise when any content of a backup is missing, truncated or altered."""
    named = {content.sha256: key for key, content in manifest.files.items()}
    contents = manifest.contents()
    progress = Progress("verified", len(contents))

    def one(sha256: str) -> None:
        backups.require_whole(contents[sha256], named.get(sha256, "the database"))

    for sha256, _ in _each(one, contents):
        progress.done += 1
        progress.copied += contents[sha256].size
        report(progress)


def _each(work: Callable[[str], T], names: Iterable[str]) -> Iterator[tuple[str, T]]:
    """Yield the result of each name as it is finished; the first error ends the rest."""
    with ThreadPoolExecutor(THREADS) as pool:
        futures = {pool.submit(work, name): name for name in names}
        try:
            for future in as_completed(futures):
                yield futures[future], future.result()
        finally:
            pool.shutdown(wait=True, cancel_futures=True)


def _mb(contents: Iterable[Content]) -> float:
    return sum(content.size for content in contents) / 1e6
