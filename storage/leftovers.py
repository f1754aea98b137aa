"""Find and remove what killed processes left on this machine.

Half-written files (`.part-`), scratch folders, and folders of work. A process holds a lock on what
it is writing, and the kernel releases it when it dies; what is not locked is a leftover and is
removed under its lock, so that no process can begin to use it meanwhile. A training that was killed
is the exception: its checkpoint is worth going on from, until the same training has been finished
elsewhere.
"""

import fcntl
import logging
import math
import os
import shutil
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

from robojackson.errors import StoreError
from robojackson.files.local_folder import TEMPORARY, LocalFolder
from robojackson.pipeline.folder_lock import locked
from storage import study_tables
from storage.store import HELD, SCRATCH, Store

log = logging.getLogger(__name__)
TASK, PROCESS = "task.lock", "lock"
"""What the flow and the training hold of a folder of work."""
TRAINING, EVALUATION = "train-", "evaluate-"
YOUNG_S = 60.0
"""A folder may be younger than the lock in it."""
REMEMBERED_S = 60.0
_remembered: dict[str, tuple[float, set[str]]] = {}
"""When this process listed the finished trainings of a store, and which there were."""


def sweep(store: Store, parts: bool = True, work: bool = True) -> list[Path]:
    """Remove leftovers of dead processes; what a living process works on stays.

    Args:
        parts: Look for half-written files, too: in all folders of the store, if it is on a disk.
        work: Also remove leftovers of ablation cells: their tables show what is still needed.
    """
    gone = [
        *(_parts(store) if parts else ()),
        *_scratch(store),
        *(_work(store) if work else ()),
    ]
    for path in gone:
        log.info("removed leftover of a dead process: %s", path)
    return gone


def _parts(store: Store) -> Iterator[Path]:
    """Yield the files whose writing was not finished."""
    if not isinstance(store.place, LocalFolder):
        return
    for folder, _, names in os.walk(store.place.root):  # a folder may go away while it is read
        for path in (Path(folder, name) for name in names if name.startswith(TEMPORARY)):
            with suppress(OSError), path.open("rb") as file:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                path.unlink(missing_ok=True)
                yield path


def _scratch(store: Store) -> Iterator[Path]:
    for folder in _folders(store, f"{SCRATCH}/*"):
        if (folder / HELD).exists() or _age_s(folder) > YOUNG_S:
            with suppress(StoreError, OSError), locked(folder, HELD):
                shutil.rmtree(folder, ignore_errors=True)
                yield folder


def _work(store: Store) -> Iterator[Path]:
    """Yield folders of evaluations, which start again, and of trainings that were finished
    elsewhere."""
    left = [f for f in _folders(store, f"{TRAINING}*") if not is_held(f / TASK)]
    finished = _finished(store) if left else set()
    unneeded = [folder for folder in left if folder.name.removeprefix(TRAINING) in finished]
    for folder in [*_folders(store, f"{EVALUATION}*"), *unneeded]:
        try:
            with locked(folder, TASK), locked(folder, PROCESS):
                shutil.rmtree(folder, ignore_errors=True)
        except (StoreError, FileNotFoundError):
            continue
        yield folder


def _finished(store: Store) -> set[str]:
    """Return the digests of the trainings whose cells are in the tables; for a minute those of the
    last time, since each cell of a study sweeps twice and the list may be long."""
    when, found = _remembered.get(store.root, (-math.inf, set[str]()))
    if time.monotonic() - when >= REMEMBERED_S:
        tables = [
            {_digest(key) for key in store.list(f"{study_tables.FOLDER}/{t}")}
            for t in study_tables.CELL
        ]
        found = set.intersection(*tables)
        _remembered[store.root] = time.monotonic(), found
    return found


def _digest(key: str) -> str:
    return Path(key).stem.rpartition("-")[2]


def _folders(store: Store, pattern: str) -> list[Path]:
    return [path for path in (store.here / "work").glob(pattern) if path.is_dir()]


def _age_s(path: Path) -> float:
    try:
        return time.time() - path.stat().st_mtime
    except FileNotFoundError:
        return 0.0


def is_held(path: Path) -> bool:
    """Return whether a living process has locked the file."""
    try:
        with path.open("rb") as file:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except OSError:
        return False
    return False
