"""Tests of one group run in one process, and a process that crashes is named at once."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
GROUPED = """
import os, signal
import pytest

@pytest.mark.xdist_group("one")
@pytest.mark.parametrize("number", range(6))
def test_a(number):
    if {crashes} and number == 2:
        os.kill(os.getpid(), signal.SIGKILL)

@pytest.mark.parametrize("number", range(20))
def test_b(number):
    pass
"""


def run(folder: Path, crashes: bool) -> str:
    """Return what pytest prints with the Makefile's options, in two processes."""
    (folder / "test_grouped.py").write_text(GROUPED.format(crashes=crashes))
    found = re.search(r"^PYTEST := .*\$\(WORKERS\) (.*)$", (ROOT / "Makefile").read_text(), re.M)
    assert found
    options = ("-v", "-n2", *found[1].split(), "--rootdir=.", "-c/dev/null")
    command = [sys.executable, "-m", "pytest", *options, "test_grouped.py"]
    done = subprocess.run(
        command, cwd=folder, capture_output=True, text=True, check=False, timeout=120
    )
    return done.stdout


@pytest.mark.slow
def test_the_marks_of_a_group_are_heeded(tmp_path: Path) -> None:
    """pytest 9.2 with pytest-xdist 3.8 spreads a group without a word (pytest-xdist issue 1386)."""
    output = run(tmp_path, crashes=False)
    assert len(re.findall(r"PASSED .*\[\d\]@one", output)) == 6, output


@pytest.mark.slow
def test_a_crash_ends_the_run_and_is_named(tmp_path: Path) -> None:
    """With a new process in its place pytest-xdist waits for ever."""
    output = run(tmp_path, crashes=True)
    assert "crashed while running 'test_grouped.py::test_a[2]@one'" in output
