"""The reference of the public functions is built from their docstrings, without a warning."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

import robojackson as rj
from tests.package.conftest import ROOT

pytestmark = pytest.mark.slow


def test_every_public_name_stands_in_the_reference(tmp_path: Path) -> None:
    words = ("-m", "mkdocs", "build", "--strict", "--quiet", "--site-dir", str(tmp_path))
    done = subprocess.run(
        [sys.executable, *words], cwd=ROOT, capture_output=True, text=True, check=False,
        env={**os.environ, "NO_MKDOCS_2_WARNING": "1"},
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    pages = "".join(path.read_text() for path in tmp_path.rglob("index.html"))
    public = set(rj.__all__) - {"__version__", "RoboJacksonError"}
    assert {name for name in public if f'.{name}"' not in pages} == set()
    assert "(T, 33, 3)" in pages
