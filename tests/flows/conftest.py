"""The command line in a process of its own, and a second of our own clip to feed it."""

import json
import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from robojackson.clips.trim import trim

ROOT = Path(__file__).parents[2]
SPY = """
import sys
from flows.cli import app
try:
    app(sys.argv[1:])
finally:
    sys.stderr.write("\\nprefect loaded: %s\\n" % ("prefect" in sys.modules))
"""


@dataclass(frozen=True)
class Said:
    """What a command left behind."""

    code: int
    out: str
    err: str

    @property
    def answer(self) -> dict[str, Any]:
        """The one JSON object on stdout."""
        return json.loads(self.out)

    @property
    def loaded_prefect(self) -> bool:
        return "prefect loaded: True" in self.err


def environment(**more: str) -> dict[str, str]:
    return {**os.environ, "PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1", **more}


def robojackson(*words: object, **more: str) -> Said:
    """Run a command in a process of its own."""
    command = [sys.executable, "-c", SPY, *map(str, words)]
    done = subprocess.run(
        command, capture_output=True, text=True, timeout=200, env=environment(**more), check=False
    )
    return Said(done.returncode, done.stdout, done.stderr)


@pytest.fixture(scope="session")
def short_clip(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The first second of the hip shake."""
    out = tmp_path_factory.mktemp("clip") / "hips.mp4"
    return trim(ROOT / "clips" / "hip_shake.mp4", 0.0, 1.0, out)
