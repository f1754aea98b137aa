"""The files of a store that a backup has, each with a stamp that changes whenever it is written."""

import os
import time
from pathlib import Path
from typing import Any

import fsspec

from robojackson.errors import BackupFailed
from robojackson.files.file_tree import in_one_line
from robojackson.files.local_folder import TEMPORARY, LocalFolder, files_in
from robojackson.files.places import Remote
from storage.prefect_database import Database
from storage.sqlite_database import SQLite
from storage.store import Store

WORK = "work/"
"""Folder of unfinished trainings and scratch files: they belong to processes of one machine."""
LIVE = "prefect/prefect.db"
"""Prefect's own database and its journals in a local store: dumped, not copied."""
RECENT_S = 2.0
"""A file changed so recently may change again without a newer time."""


def entries(
    store: Store, database: Database, may_be_missing: bool = False, without: Path | None = None
) -> dict[str, str | None]:
    """Return the files of a store that a backup has, each with its stamp.

    Args:
        may_be_missing: A folder or bucket that does not exist counts as empty.
        without: A folder that is left out, also where the store has a link to it.
    Raises:
        BackupFailed: the store cannot be listed, or a name in it is no UTF-8.
    """
    with in_one_line(f"cannot list {store.root}", BackupFailed):
        try:
            found = _found(store, without)
        except FileNotFoundError:
            if not may_be_missing:
                raise
            found = {}
    own = key_of(store, database.path) if isinstance(database, SQLite) else None
    chosen = {}
    for key, stamp in found.items():
        if key.startswith((WORK, LIVE)) or (own and key.startswith(own)):
            continue
        if not key.isascii() and key != key.encode(errors="replace").decode():
            raise BackupFailed(f"{store.address(key)!a}: the name is no UTF-8; rename the file")
        chosen[key] = stamp
    return chosen


def _found(store: Store, without: Path | None) -> dict[str, str | None]:
    if isinstance(store.place, LocalFolder):
        return _local(store.place.root, without)
    assert isinstance(store.place, Remote)
    return _remote(store.place.url)


def _local(root: Path, without: Path | None) -> dict[str, str | None]:
    """Return the files of a folder, with what changes whenever one is written."""
    found: dict[str, str | None] = {}
    os.stat(root)  # of a folder that does not exist there are no files
    for path in files_in(root, without):
        if TEMPORARY in path.name:
            continue
        try:
            facts = path.stat()
        except FileNotFoundError:
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


def key_of(store: Store, path: Path) -> str | None:
    """Return the key of a path in a local store, which may itself be a link; None elsewhere."""
    if not isinstance(store.place, LocalFolder):
        return None
    inside, root = path.parent.resolve() / path.name, store.place.root.resolve()
    return inside.relative_to(root).as_posix() if inside.is_relative_to(root) else None
