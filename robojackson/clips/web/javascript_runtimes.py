"""The JavaScript runtimes that yt-dlp may run to read YouTube's player, and which are here."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

PROGRAMS = {"deno": "deno", "node": "node", "bun": "bun", "quickjs": "qjs"}
"""yt-dlp's name of a runtime to its program, the best first."""
OLDEST = {"deno": (2, 3), "node": (22,), "bun": (1, 2, 11)}
"""Versions that yt-dlp 2026.10 needs."""
VERSION_TIMEOUT_S = 10.0
ADVICE = (
    "a JavaScript runtime, without which yt-dlp misses formats of YouTube: "
    "pip install deno (or node 22 or later)"
)


def runtimes() -> dict[str, str]:
    """Return the installed runtimes, beside Python or on the path: name to program."""
    found = {name: _place(program) for name, program in PROGRAMS.items()}
    return {name: place for name, place in found.items() if place}


def usable() -> str | None:
    """Return the best runtime that is new enough; None where none is installed."""
    for name, program in runtimes().items():
        if name not in OLDEST or _version(program) >= OLDEST[name]:
            return name
    return None


def _place(program: str) -> str | None:
    beside = Path(sys.executable).parent / program
    return str(beside) if beside.is_file() else shutil.which(program)


def _version(program: str) -> tuple[int, ...]:
    """Return its version as (22, 1, 0); () when it prints none."""
    try:
        said = subprocess.run(
            [program, "--version"],
            capture_output=True,
            text=True,
            timeout=VERSION_TIMEOUT_S,
            check=False,
        ).stdout
    except (OSError, subprocess.TimeoutExpired):
        return ()
    found = re.search(r"\d+(\.\d+)*", said)
    return tuple(int(part) for part in found[0].split(".")) if found else ()
