"""Words that are not understood, and Ctrl-C before anything began, get one line."""

import subprocess
import sys
from pathlib import Path

import pytest

from tests.fixtures.commands import environment

COMMAND = (sys.executable, "-m", "robojackson")


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (["danse"], "danse"),
        (["dance", "--minutes", "soon"], "'soon'"),
        (["dance", "--seed=-1"], "'-1'"),
        (["dance", "--trainer", "sbxx"], "'sbxx'"),
        (["dance", "--sed", "3"], "--sed"),
        (["train", "reference.parquet"], "--out"),
        (["train", "reference.parquet", "-o", "there"], "there is a file; expected a folder"),
        (["mocap", "clip.mp4", "-o", "there/below"], "there is a file; expected a folder"),
        (["mocap", "clip.mp4", "-o", ""], "the folder's name is empty"),
        (["mocap", "clip.mp4", "-o", 300 * "a"], "the folder cannot exist: File name too long"),
    ],
)
def test_a_wrong_word_is_named_in_one_line(words: list[str], named: str, tmp_path: Path) -> None:
    (tmp_path / "there").write_text("")
    done = subprocess.run(
        [*COMMAND, *words], capture_output=True, text=True, env=environment(), check=False,
        cwd=tmp_path,
    )  # fmt: skip
    assert (done.returncode, done.stdout) == (2, "")
    assert len(done.stderr.splitlines()) == 1
    assert named in done.stderr


@pytest.mark.parametrize(("encoding", "shown"), [("utf-8", "► 3"), ("iso-8859-1", "? 3")])
def test_a_letter_that_the_terminal_has_not_ends_no_command(encoding: str, shown: str) -> None:
    code = "from robojackson.cli.start import start; start(lambda: print('► 3') or 0)"
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, check=False,
        env=environment(PYTHONIOENCODING=encoding),
    )  # fmt: skip
    assert (done.returncode, done.stderr) == (0, b"")
    assert done.stdout.decode(encoding).strip() == shown


def test_ctrl_c_while_the_command_is_imported_is_one_line() -> None:
    code = (
        "import signal, sys\n"
        "class Struck:\n"
        "    def find_spec(self, name, path=None, target=None):\n"
        "        if name == 'typer':\n"
        "            signal.raise_signal(signal.SIGINT)\n"
        "sys.meta_path.insert(0, Struck())\n"
        "import runpy\n"
        "runpy.run_module('robojackson', run_name='__main__')\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, "dance"],
        capture_output=True, text=True, env=environment(), check=False,
    )  # fmt: skip
    assert (done.returncode, done.stdout) == (130, "")
    assert done.stderr == "robojackson: interrupted: resume: robojackson dance\n"


ABORTS_AT_EXIT = """
import atexit, ctypes, sys, threading, time
from robojackson.cli.start import start

def command():
    libc = ctypes.CDLL(None)
    libc.__cxa_atexit(ctypes.cast(libc.abort, ctypes.c_void_p), None, None)
    atexit.register(print, "python has ended")
    threading.Thread(target=lambda: (time.sleep(0.2), print("so has the thread"))).start()
    print("done")
    return 3

start(command)
"""


def test_a_library_that_aborts_at_the_end_changes_no_exit_code() -> None:
    done = subprocess.run(
        [sys.executable, "-c", ABORTS_AT_EXIT], capture_output=True, text=True, env=environment(),
        check=False,
    )  # fmt: skip
    assert (done.returncode, done.stderr) == (3, "")
    assert done.stdout.splitlines() == ["done", "so has the thread"], "at-exit functions ran"
