"""Inventory of a store on a disk: age, size, and references.

Reference means: a file of JSON in the store, or the catalogue of videos, names the folder of an
artifact. The folder is named by the digest of its content, so no other text looks like it.
"""

import os
import re
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from robojackson.errors import StoreError
from robojackson.files.file_tree import in_one_line
from robojackson.files.local_folder import OF_THE_DISK, TEMPORARY, LocalFolder, files_in
from robojackson.rl.tensorboard_log import LOGS
from storage import candidate_catalogue, run_catalogue, stage_records
from storage.leftovers import PROCESS, TASK, is_held
from storage.store import HELD, Store

Kind = Literal["work", "unused", "videos", "cache", "runs", "kept"]
KINDS: dict[Kind, str] = {
    "work": "unfinished trainings, downloads and scratch files that no process holds",
    "unused": "results that no record, run or table refers to",
    "videos": "videos and their assessments that no dance refers to; downloaded again if needed",
    "cache": "records of other stages, what only they refer to, gains of feedback; made again",
    "runs": "pages, videos and logs of finished dances, and what only they refer to",
    "kept": "tables, studies, walkers, robots, Prefect's database, what is in use: never removed",
}
"""What each kind is, in the order in which they are listed."""
WORK, PAGES, DOWNLOADS, WALKERS = "work", "dances", "downloads", "pretrain"
FEEDBACK = "feedback"
"""Where `rl.feedback.cached_feedback` keeps gains."""
OF_VIDEOS = ("download_video", "take_file", "probe_video", "assess_video")
"""Stages whose records go with the videos."""
REFERRING: tuple[Kind, ...] = ("kept", "runs", "cache", "videos")
"""Kinds that refer to artifacts; the first of them that names one decides of which kind it is."""
LOCKS = (TASK, PROCESS, HELD)
"""Files by which a process holds a folder of work."""
ARTIFACT = re.compile(rb"\b[a-z_]+/[0-9a-f]{16}(?=/)")
"""The folder of an artifact in a text."""


@dataclass(frozen=True)
class Item:
    """Files that stay or go together.

    Attributes:
        kind: Kind of the files.
        key: Key of the file or folder, relative to the root.
        size: Bytes.
        age_s: Since the newest of them was written, seconds.
    """

    kind: Kind
    key: str
    size: int
    age_s: float


def inventory(store: Store) -> list[Item]:
    """Return everything in a store; an artifact is `unused` or in the kind that refers to it.

    Raises:
        StoreError: the store is no folder of this machine, or something in it cannot be read: what
            that refers to is not known.
    """
    root = root_of(store)
    named = _references(store, root)
    found = [_item(root, path, _kind_of(root, path, named)) for path in _entries(root)]
    return [item for item in found if item is not None]


def root_of(store: Store) -> Path:
    """Return the folder of a store.

    Raises:
        StoreError: it is an object store, or it does not exist yet.
    """
    if not isinstance(store.place, LocalFolder):
        raise StoreError(
            f"{store.root} is no folder of this machine; let its bucket expire old objects, or "
            "name a folder in ROBOJACKSON_STORE"
        )
    if not store.place.root.is_dir():
        raise StoreError(f"there is no store {store.place.root} yet; `robojackson dance` makes one")
    return store.place.root


def _entries(root: Path) -> Iterator[Path]:
    """Yield the folders of work, artifacts, pages and downloads, and all single files."""
    for path in (path for path in _inside(root) if path.name != OF_THE_DISK):
        if not path.is_dir():
            yield path
        elif path.name == WORK:
            yield from _folders_with_files(path)
        elif path.name in (stage_records.FOLDER, run_catalogue.FOLDER, FEEDBACK):
            yield from sorted(_files(path))
        elif path.name in (PAGES, LOGS) or _has_artifacts(path):
            yield from _inside(path)
        else:
            yield path


def _folders_with_files(folder: Path) -> Iterator[Path]:
    """Yield the topmost folders that hold a file."""
    for path in _inside(folder):
        if path.is_file() or any(inner.is_file() for inner in _inside(path)):
            yield path
        else:
            yield from _folders_with_files(path)


def _has_artifacts(folder: Path) -> bool:
    return any(re.fullmatch("[0-9a-f]{16}", path.name) for path in _inside(folder))


def _inside(folder: Path) -> list[Path]:
    """Return what is in a folder, in order; nothing where it has gone meanwhile."""
    with in_one_line(f"cannot list {folder}"), suppress(FileNotFoundError, NotADirectoryError):
        return sorted(folder.iterdir())
    return []


def _files(folder: Path) -> list[Path]:
    """Return the files of a folder that is walked while others work in it; links are not left."""
    walk = os.walk(folder, onerror=_refuse)
    found = (Path(inner, name) for inner, _, names in walk for name in names)
    return [path for path in found if path.is_file()]


def _refuse(cause: OSError) -> None:
    """Raise what keeps a folder from being listed, unless it has gone meanwhile."""
    if not isinstance(cause, FileNotFoundError | NotADirectoryError):
        raise StoreError(f"cannot list {cause.filename}: {cause.strerror}") from cause


def _kind_of(root: Path, entry: Path, named: Callable[[str], Kind | None]) -> Kind:
    path = entry.relative_to(root)
    top = path.parts[0]
    if top == WORK:
        return "work"
    if _kind_of_text(path) == "videos" and top == stage_records.FOLDER:
        return "videos" if {named(one) for one in _named_in(entry)} == {"videos"} else "cache"
    if top in (stage_records.FOLDER, FEEDBACK):
        return "cache"
    if top in (PAGES, LOGS, run_catalogue.FOLDER):
        return "runs"
    if len(path.parts) == 2 and top != WALKERS:
        return named(path.as_posix()) or "unused"
    return "kept"


def _references(store: Store, root: Path) -> Callable[[str], Kind | None]:
    """Return what finds the kind that refers to an artifact: what is kept longest decides."""
    found: dict[Kind, set[str]] = {kind: set() for kind in REFERRING}
    with in_one_line(f"cannot list {root}"):
        texts = [path for path in files_in(root) if path.suffix == ".json"]
    for path in texts:
        kind = _kind_of_text(path.relative_to(root))
        if kind in REFERRING:
            found[kind] |= _named_in(path)
    sql = "SELECT DISTINCT video_key FROM candidates WHERE video_key IS NOT NULL"
    keys = (str(row["video_key"]) for row in candidate_catalogue.query(store, sql))
    found["videos"] |= {key.rpartition("/")[0] for key in keys}

    def named(folder: str) -> Kind | None:
        return next((kind for kind in REFERRING if folder in found[kind]), None)

    return named


def _kind_of_text(path: Path) -> Kind:
    """Return the kind of a file that may name artifacts: one inside an artifact counts as kept."""
    kinds: dict[str, Kind] = {stage_records.FOLDER: "cache", run_catalogue.FOLDER: "runs"}
    kinds |= {PAGES: "runs", WORK: "work", DOWNLOADS: "videos"}
    if path.parts[0] == stage_records.FOLDER and path.parts[1] in OF_VIDEOS:
        return "videos"
    return kinds.get(path.parts[0], "kept")


def _named_in(path: Path) -> set[str]:
    return {match.decode() for match in ARTIFACT.findall(content_of(path))}


def content_of(path: Path) -> bytes:
    """Return the content of a file; nothing where it has gone meanwhile, or is a pipe.

    Raises:
        StoreError: it cannot be read.
    """
    with in_one_line(f"cannot read {path}"), suppress(FileNotFoundError):
        if path.is_file():
            return path.read_bytes()
    return b""


def _item(root: Path, path: Path, kind: Kind) -> Item | None:
    """Return the size and age of a file or folder; None where it has gone meanwhile."""
    files = [path] if path.is_file() else _files(path)
    facts = []
    for each in (each for each in files if TEMPORARY not in each.name):
        with suppress(FileNotFoundError):
            facts.append(each.stat())
    if not facts:
        return None
    if kind == "work" and any(is_held(path / name) for name in LOCKS):
        kind = "kept"
    age_s = time.time() - max(fact.st_mtime for fact in facts)
    key = path.relative_to(root).as_posix()
    return Item(kind, key, sum(fact.st_size for fact in facts), max(age_s, 0.0))
