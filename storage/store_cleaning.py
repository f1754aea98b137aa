"""Removing from a store what is old: unfinished work and unused results; by request more kinds.

A folder of work is removed under its locks, as in `leftovers`. The other kinds stay
while a process works with the store: it may know of results that no record names yet.
"""

import json
import os
import re
import shutil
from collections.abc import Collection
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from pathlib import Path

from robojackson.errors import StoreError
from robojackson.files.local_folder import files_in, folder_of
from robojackson.pipeline.folder_lock import locked
from storage.run_catalogue import FOLDER as RUNS
from storage.stage_records import FOLDER as RECORDS
from storage.store import DEFAULT_ROOT, VARIABLE, Store
from storage.store_inventory import (
    ARTIFACT,
    LOCKS,
    PAGES,
    WORK,
    Item,
    Kind,
    content_of,
    inventory,
    root_of,
)

PAGE = re.compile(rb'"' + PAGES.encode() + rb'/[^/"]+(?=/)')
"""The folder of a dance in the record of a run, after the quotation mark of its JSON text."""
USUAL: tuple[Kind, ...] = ("work", "unused")
"""Kinds that nothing is lost with but time."""
IDLE = {"server", "clean", "doctor", "metrics", "catalogue", "robots", "deploy"}
"""Commands of ours that make no results."""
FLOWS = {"prefect.engine", "prefect.flow_engine", "prefect.runner._workspace_supervisor"}
"""What a worker of Prefect starts for a run."""


@dataclass(frozen=True)
class Cleaning:
    """Plan of what to remove and what to keep.

    Attributes:
        items: Everything in the store.
        old: What is requested and old enough.
        users: Processes that work with the store; while there are any, only folders of work go.
    """

    items: list[Item]
    old: list[Item]
    users: list[str]

    @property
    def going(self) -> list[Item]:
        """What `clean` removes now."""
        return [item for item in self.old if item.kind == WORK or not self.users]


def plan(store: Store, kinds: Collection[Kind], older_than_s: float) -> Cleaning:
    """Return what a cleaning would remove; nothing is changed.

    Args:
        kinds: Those that are requested. What a record or a run that stays refers to stays, too.
        older_than_s: Least age, seconds.
    Raises:
        StoreError: the store is no folder of this machine.
    """
    found = inventory(store)
    old = [item for item in found if item.kind in kinds and item.age_s >= older_than_s]
    return Cleaning(found, _without_named(store, old), users_of(root_of(store)))


@dataclass(frozen=True)
class Removal:
    """Result of a cleaning.

    Attributes:
        gone: What was removed.
        failed: Why something could not be removed, by its key.
    """

    gone: list[Item]
    failed: dict[str, str]


def remove(store: Store, cleaning: Cleaning) -> Removal:
    """Remove what a plan lists. What is locked meanwhile stays."""
    root = root_of(store)
    done = Removal([], {})
    for item in cleaning.going:
        reason = _remove(root / item.key, item.kind == WORK)
        if reason:
            done.failed[item.key] = reason
        elif not (root / item.key).exists():
            done.gone.append(item)
    return done


def users_of(root: Path) -> list[str]:
    """Return the commands, with their process ids, that work with a store (Linux only)."""
    own = {os.getpid(), os.getppid()}
    found = []
    for folder in Path("/proc").glob("[0-9]*"):
        with suppress(OSError):
            words = (folder / "cmdline").read_bytes().decode(errors="replace").split("\0")
            command = _command(words)
            if command and int(folder.name) not in own and _store_of(folder) == root.resolve():
                found.append(f"{command} (process {folder.name})")
    return sorted(found)


def _without_named(store: Store, old: list[Item]) -> list[Item]:
    """Leave out what a younger record or run, that stays, refers to as well."""
    root, going = root_of(store), {item.key for item in old}
    stay = [
        path
        for folder in (RECORDS, RUNS)
        for path in files_in(root / folder)
        if path.suffix == ".json" and path.relative_to(root).as_posix() not in going
    ]
    named: set[str] = set()
    for path in stay:
        content = content_of(path)
        results = {found.decode() for found in ARTIFACT.findall(content)}
        named |= {key for key in results if not key.startswith(f"{PAGES}/")}
        if path.is_relative_to(root / RUNS):
            named |= {json.loads(found + b'"') for found in PAGE.findall(content)}
    return [item for item in old if item.key not in named]


def _command(words: list[str]) -> str:
    """Return the command of a process of ours; empty for any other process."""
    for place, word in enumerate(words):
        if word in FLOWS:
            return "a run of a worker"
        if Path(word).name == "robojackson" or word == "robojackson.cli":
            following = next(iter(words[place + 1 :]), "")
            return f"robojackson {following}" if following and following not in IDLE else ""
    return ""


def _store_of(process: Path) -> Path:
    """Return the folder that a process uses as its store."""
    variables = (process / "environ").read_bytes().decode(errors="replace").split("\0")
    named = dict(each.partition("=")[::2] for each in variables)
    root = named.get(VARIABLE) or DEFAULT_ROOT
    return (Path(os.readlink(process / "cwd")) / (folder_of(root) or root)).resolve()


def _remove(path: Path, is_work: bool) -> str:
    """Remove a file or a folder; return why it cannot be, nothing of one that is locked."""
    try:
        with suppress(StoreError, FileNotFoundError), ExitStack() as held:
            if is_work and path.is_dir():
                for name in LOCKS:
                    held.enter_context(locked(path, name))
            if path.is_dir():
                shutil.rmtree(path)
            else:
                path.unlink(missing_ok=True)
    except OSError as cause:
        return cause.strerror or str(cause)
    return ""
