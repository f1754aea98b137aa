"""The hashed locks in `locks/`, one for each Python: packages with their digests, all but torch and
tfp-nightly.

    python -m pip install uv && python -m tools.assets.lock

To install from one: torch first (its builds differ by machine), then

    python -m pip install --require-hashes --no-deps -r locks/py311.txt
    python -m pip install --no-deps --pre tfp-nightly
    python -m pip install --no-deps -e .
"""

import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
PYTHONS = ("3.11", "3.12", "3.13")
EXTRAS = ("app", "fast", "s3", "onnx", "trackers")
APART = re.compile(r"^(torch|triton|nvidia-|cuda-|tfp-nightly|opencv-(contrib-)?python==)")
"""Packages that come with torch, from where it comes; a nightly build, which no digest holds for
long; those that would hide the headless OpenCV."""
HEAD = "# Made by `python -m tools.assets.lock`; torch and tfp-nightly are apart.\n"


def lock(python: str) -> str:
    """Return the lock of one Python, as pip reads it."""
    extras = [word for extra in EXTRAS for word in ("--extra", extra)]
    command = [
        *(sys.executable, "-m", "uv", "pip", "compile", "pyproject.toml", *extras),
        *("--constraint", "constraints.txt", "--generate-hashes", "--no-header", "--no-annotate"),
        *("--python-version", python, "--python-platform", "x86_64-manylinux_2_28"),
    ]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    if done.returncode:
        raise SystemExit(done.stderr)
    blocks = re.split(r"\n(?=\S)", done.stdout.strip())
    return HEAD + "\n".join(block for block in blocks if not APART.match(block)) + "\n"


def main() -> None:
    """Write the lock of every Python."""
    folder = ROOT / "locks"
    folder.mkdir(exist_ok=True)
    for python in PYTHONS:
        (folder / f"py{python.replace('.', '')}.txt").write_text(lock(python))


if __name__ == "__main__":
    main()
