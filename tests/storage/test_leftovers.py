"""What killed processes left goes away; what living ones hold, and what is worth keeping, stays."""

import os
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from robojackson.files import local_folder
from robojackson.pipeline.folder_lock import locked
from storage import leftovers
from storage.leftovers import sweep
from storage.store import Store
from storage.study_tables import CELL, Place

ROOT = Path(__file__).parents[2]
DIES = """
import os, signal, sys
from pathlib import Path
from typing import Any
from robojackson.files import local_folder
from storage.store import Store
def die(file, source):
    file.write(b"half")
    file.flush()
    os.kill(os.getpid(), signal.SIGKILL)
local_folder._fill = die
store = Store(sys.argv[1])
with store.scratch() as folder:
    (folder / "film.mp4").write_bytes(b"frames")
    store.put("mocap/a.bin", b"whole")
"""
RUN = "walk-scratch-s0-0123456789ab"


@pytest.fixture
def store(tmp_path: Path) -> Store:
    return Store(tmp_path / "store")


def files(store: Store) -> list[str]:
    found = (path for path in Path(store.root).rglob("*") if path.is_file())
    return sorted(path.relative_to(store.root).as_posix() for path in found)


def work(store: Store, name: str) -> Path:
    folder = store.work(name)
    (folder / "checkpoint.zip").write_bytes(b"weights")
    return folder


def finish(store: Store) -> None:
    place = Place("study", "walk", "scratch", 0, RUN)
    for table in CELL:
        store.put(place.key(table), b"rows")


def test_a_process_killed_while_it_writes_leaves_nothing_for_long(store: Store) -> None:
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-c", DIES, store.root]
    done = subprocess.run(command, env=environment, capture_output=True, check=False)
    assert (done.returncode, len(files(store))) == (-signal.SIGKILL, 3)
    sweep(store)
    assert files(store) == []


def test_files_and_folders_that_are_held_stay(store: Store) -> None:
    judging = work(store, "evaluate-1")
    with store.scratch() as folder, locked(judging, "task.lock"):
        (folder / "film.mp4").write_bytes(b"frames")
        before = files(store)
        assert sweep(store) == []
        assert files(store) == before


def test_a_evaluation_without_a_process_is_removed(store: Store) -> None:
    folder = work(store, "evaluate-1")
    assert sweep(store) == [folder]
    assert not folder.exists()


def test_the_finished_trainings_are_listed_once_a_minute(
    store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each cell sweeps twice, and the tables of all studies may be many."""
    folder = work(store, f"train-{RUN[-12:]}")
    assert sweep(store) == []
    finish(store)
    assert sweep(store) == []
    monkeypatch.setattr(leftovers, "REMEMBERED_S", 0.0)
    assert sweep(store) == [folder]


@pytest.mark.parametrize("lock", ["task.lock", "lock"])
def test_a_finished_training_stays_while_a_process_uses_it(store: Store, lock: str) -> None:
    folder = work(store, f"train-{RUN[-12:]}")
    finish(store)
    with locked(folder, lock):
        assert sweep(store) == []
    assert sweep(store) == [folder]


@pytest.mark.parametrize(
    ("leave", "kept"),
    [(finish, False), (lambda store: None, True)],
    ids=["finished elsewhere", "unfinished"],
)
def test_only_a_checkpoint_that_is_still_needed_is_kept(
    store: Store, leave: Callable[[Store], None], kept: bool
) -> None:
    folder = work(store, f"train-{RUN[-12:]}")
    leave(store)
    sweep(store)
    assert folder.exists() == kept


def test_a_file_that_is_swept_before_it_is_held_is_started_again(
    store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Another process may sweep between the making of a temporary file and its lock."""
    hold = local_folder.fcntl.flock
    swept: list[Path] = []

    def late(file: object, how: int) -> None:
        if not swept:
            swept.append(Path("under way"))
            swept.extend(sweep(store))
        hold(file, how)

    monkeypatch.setattr(local_folder.fcntl, "flock", late)
    store.put("mocap/a.bin", b"whole")
    assert (len(swept), files(store)) == (2, ["mocap/a.bin"])


def test_a_folder_that_goes_away_while_the_store_is_looked_through_does_no_harm(
    store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    list_names = os.scandir
    store.put("a/.part-1", b"half")
    store.put("b/c.bin", b"whole")

    def vanished(path: object) -> object:
        if Path(str(path)).name == "b":
            raise FileNotFoundError(path)
        return list_names(path)

    monkeypatch.setattr(os, "scandir", vanished)
    assert [path.name for path in sweep(store)] == [".part-1"]
