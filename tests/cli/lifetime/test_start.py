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
        (["train", "reference.parquet", "-o", "there"], "there is a file; a folder is wanted"),
        (["mocap", "clip.mp4", "-o", "there/below"], "there is a file; a folder is wanted"),
        (["mocap", "clip.mp4", "-o", ""], "no folder is named"),
        (["mocap", "clip.mp4", "-o", 300 * "a"], "no folder can be there: File name too long"),
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
