"""How faults, kills and long runs are rated; the campaigns themselves are run by hand."""

import errno
import os
import random
import subprocess
import sys
from collections import Counter
from pathlib import Path

import pytest

from robojackson.errors import StoreError
from robojackson.files import local_folder
from robojackson.files.file_tree import FileTree
from tests.chaos.faults import _refused
from tests.chaos.kills import _victim
from tests.chaos.soak import growth
from tools.stack.processes import Found

LINE = "robojackson: StoreError: cannot write x: No space left on device\n"


@pytest.mark.parametrize(
    ("code", "err", "wrong"),
    [
        (1, LINE, ""),
        (0, LINE, "exit code 0"),
        (134, "terminate called\n", "exit code 134"),
        (1, LINE + LINE, "not one line"),
        (1, "Traceback (most recent call last):\n" + LINE, "not one line"),
        (1, "robojackson: StoreError: x\n", "does not say 'No space left'"),
    ],
)
def test_a_refusal_is_one_line_with_code_1(code: int, err: str, wrong: str) -> None:
    assert _refused(code, err, "No space left") == wrong


def test_a_line_has_the_slope_that_it_has() -> None:
    rows = [{"minute": m / 2, "memory_mb": 100 + 0.25 * m} for m in range(60)]
    assert growth(rows, "memory_mb") == pytest.approx(30.0)


def test_command_worker_and_others_are_killed_equally_often() -> None:
    """However many others there are: nine are each drawn nine times more seldom than the worker."""
    me, rng = os.getpid(), random.Random(0)
    with subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE) as child:
        others = [Found(number, "other", Path()) for number in range(-9, 0)]
        found = [Found(me, "command", Path()), Found(child.pid, "worker", Path()), *others]
        drawn = Counter(_victim(rng, me, found).command for _ in range(600))
        child.kill()
    assert drawn.keys() == {"command", "worker", "other"}
    assert all(150 < count < 250 for count in drawn.values()), drawn


@pytest.mark.parametrize("nth", range(3))
def test_a_disk_that_fills_at_any_write_keeps_what_was_whole(
    nth: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The n-th write finds no room after half of its bytes."""
    written, fill = [], local_folder._fill

    def failing(file: object, source: object) -> None:
        written.append(source)
        if len(written) == nth + 1:
            fill(file, b"half")
            raise OSError(errno.ENOSPC, "No space left on device")
        fill(file, source)

    monkeypatch.setattr(local_folder, "_fill", failing)
    tree = FileTree(tmp_path)
    for number in range(nth):
        tree.write(str(number), b"a whole file")
    with pytest.raises(StoreError, match=f"cannot write {tmp_path}/{nth}: No space left"):
        tree.write(str(nth), b"a whole file")
    assert {f.name: f.read_bytes() for f in tmp_path.iterdir()} == {
        str(number): b"a whole file" for number in range(nth)
    }
