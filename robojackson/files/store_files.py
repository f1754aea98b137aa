"""Files that are added to the store and that the library reads by path: models of robots, trackers.

They are used where they lie if the store is a folder of this machine. Else the store has them under
the same keys, and each machine copies what it uses into the user's cache, whole or not at all.
"""

import fcntl
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path, PurePosixPath

from robojackson.errors import StoreError
from robojackson.files.file_tree import FileTree, in_one_line
from robojackson.files.local_folder import cache_of, folder_of, sha256_of, sha256_of_file

VARIABLE, DEFAULT = "ROBOJACKSON_STORE", "store"
LOCK = ".copying"
"""Locked while a file or folder is copied here: of several processes that need it, one copies."""


def files_here() -> Path:
    """Return the folder that keys of added files are relative to: the store, or its cache where it
    is no folder."""
    address = _address()
    return folder_of(address) or cache_of(address)


def is_whole(path: Path, sha256: str | None) -> bool:
    """Return whether a file exists, and is the expected one where its digest is known."""
    return path.is_file() and (sha256 is None or sha256_of_file(path) == sha256)


def is_shared(key: str) -> bool:
    """Return whether a store that is no folder has a file."""
    store = _elsewhere()
    return store is not None and store.exists(key)


def copy_file_here(key: str, sha256: str) -> None:
    """Copy a file of a store that is no folder; nothing where it is here, or is not there.

    Raises:
        StoreError: the store does not answer, or the cache cannot be written.
    """
    path, store = files_here() / key, _elsewhere()
    if store is None or not store.exists(key):
        return
    with _one_copies(path.parent):
        if is_whole(path, sha256):
            return
        content = store.read(key)
        if sha256_of(content) == sha256:
            FileTree(path.parent).write(path.name, content)


def copy_folder_here(folder: str, entry: str, sha256: str | None) -> None:
    """Copy a folder of a store that is no folder; nothing where it is here, or is not there.

    Args:
        folder: Its key.
        entry: File in it that `share_folder` wrote last; a folder without it is not whole.
        sha256: Expected digest of that file; None takes any.
    Raises:
        StoreError: the store does not answer, or the cache cannot be written.
    """
    path, store = files_here() / folder, _elsewhere()
    if store is None or not store.exists(f"{folder}/{entry}"):
        return
    with _one_copies(path.parent):
        if is_whole(path / entry, sha256):
            return
        if sha256 is None or store.sha256(f"{folder}/{entry}") == sha256:
            _copy_folder(store, folder, path)


def share_file(key: str) -> bool:
    """Copy an added file of this machine into a store that is no folder; return whether it was
    missing there.

    Raises:
        StoreError: the store cannot be read or written.
    """
    path, store = files_here() / key, _elsewhere()
    if store is None or (store.exists(key) and store.sha256(key) == sha256_of_file(path)):
        return False
    store.write(key, path)
    return True


def share_folder(folder: str, entry: str) -> bool:
    """Copy an added folder of this machine into a store that is no folder; return whether it was
    missing there.

    Args:
        folder: Its key.
        entry: File in it that is written last: other machines take no folder without it.
    Raises:
        StoreError: the store cannot be read or written.
    """
    path, store = files_here() / folder, _elsewhere()
    key = f"{folder}/{entry}"
    if store is None or (store.exists(key) and store.sha256(key) == sha256_of_file(path / entry)):
        return False
    names = {file.relative_to(path).as_posix() for file in path.rglob("*") if file.is_file()}
    for name in [*sorted(names - {entry}), entry]:
        store.write(f"{folder}/{name}", path / name)
    return True


def _address() -> str:
    return os.environ.get(VARIABLE) or DEFAULT


def _elsewhere() -> FileTree | None:
    """Return the store where it is no folder of this machine."""
    address = _address()
    if folder_of(address) is not None:
        return None
    from robojackson.files.places import place_at  # fsspec: only where it is needed

    with in_one_line(f"cannot open the store {address}"):
        return FileTree(address, place_at(address))


@contextmanager
def _one_copies(folder: Path) -> Iterator[None]:
    """Hold a folder of this machine while something is copied into it."""
    with in_one_line(f"cannot write {folder}"):
        folder.mkdir(parents=True, exist_ok=True)
        lock = (folder / LOCK).open("w")
        fcntl.flock(lock, fcntl.LOCK_EX)
    with lock:
        yield


def _copy_folder(store: FileTree, folder: str, path: Path) -> None:
    with (
        in_one_line(f"cannot write {path}"),
        tempfile.TemporaryDirectory(dir=path.parent, prefix=".adding-") as scratch,
    ):
        fresh = FileTree(Path(scratch) / "fresh")
        for key in store.list(folder):
            name = key.removeprefix(f"{folder}/")
            if ".." in PurePosixPath(name).parts:
                raise StoreError(f"{store.address(key)} leads out of its folder; remove it there")
            fresh.write(name, store.read(key))
        if path.exists():
            path.rename(Path(scratch) / "old")
        Path(fresh.root).rename(path)
