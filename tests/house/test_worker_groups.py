"""Tests of one group run in one process: what a module makes once is not made in each."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

GROUPED = """
import pytest

@pytest.mark.xdist_group("one")
@pytest.mark.parametrize("number", range(6))
def test_a(number):
    pass
"""


@pytest.mark.slow
def test_the_marks_of_a_group_are_heeded(tmp_path: Path) -> None:
    """pytest 9.2 with pytest-xdist 3.8 spreads a group without a word (pytest-xdist issue 1386)."""
    (tmp_path / "test_grouped.py").write_text(GROUPED)
    options = ("-v", "-n2", "--dist=loadgroup", "--rootdir=.", "-c/dev/null")
    command = [sys.executable, "-m", "pytest", *options, "test_grouped.py"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True)
    assert len(re.findall(r"PASSED .*\[\d\]@one", done.stdout)) == 6, done.stdout
