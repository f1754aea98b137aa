"""What killed processes left goes away; what living ones hold, and what is worth keeping, stays."""

import os
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from storage.leftovers import sweep
from storage.lock import locked
from storage.metrics import TABLES, Place
from storage.store import Store

ROOT = Path(__file__).parents[2]
DIES = """
import os, signal, sys
from pathlib import Path
from storage import places
from storage.store import Store
def die(file, source):
    file.write(b"half")
    file.flush()
    os.kill(os.getpid(), signal.SIGKILL)
places._fill = die
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
    for table in TABLES:
        store.put(place.key(table), b"rows")


def test_a_process_killed_while_it_writes_leaves_nothing_for_long(store: Store) -> None:
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-c", DIES, store.root]
    done = subprocess.run(command, env=environment, capture_output=True, check=False)
    assert (done.returncode, len(files(store))) == (-signal.SIGKILL, 3)
    sweep(store)
    assert files(store) == []


def test_files_and_folders_that_are_held_stay(store: Store) -> None:
    judging = work(store, "judge-1")
    with store.scratch() as folder, locked(judging, "task.lock"):
        (folder / "film.mp4").write_bytes(b"frames")
        before = files(store)
        assert sweep(store) == []
        assert files(store) == before


def test_a_judgement_that_nobody_makes_is_taken_away(store: Store) -> None:
    folder = work(store, "judge-1")
    assert sweep(store) == [folder]
    assert not folder.exists()


@pytest.mark.parametrize("lock", ["task.lock", "lock"])
def test_a_finished_training_stays_while_somebody_is_at_it(store: Store, lock: str) -> None:
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
