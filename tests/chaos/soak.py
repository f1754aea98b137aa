"""A long run of a nightly refresh and of a training: memory, handles and disk, as they go on.

    python -m tests.chaos.soak [--minutes 30]

One process refreshes again and again from a server of its own, which has a new video every time;
another trains. All processes below each are looked at every few seconds. Writes
`benchmarks/results/soak.json` and `docs/images/soak.png`. Linux only.
"""

import argparse
import asyncio
import json
import os
import struct
import subprocess
import sys
import tempfile
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from robojackson.clips.trim import trim
from tests.badinput.base import CLIP, base
from tools.stack.processes import under
from tools.stack.service import ROOT

RESULTS = ROOT / "benchmarks" / "results" / "soak.json"
PICTURE = ROOT / "docs" / "images" / "soak.png"
EVERY_S = 5.0
COLUMNS = {"memory_mb": "memory, MB", "handles": "open files", "disk_mb": "disk, MB"}
OVERRIDES = {"web.private_addresses": True, "web.request_pause_s": 0, "web.retries": 1}


def refresh_for_ever(folder: Path) -> None:
    """Refresh one dance; every time the list has one address more, of another file."""
    from prefect.settings import PREFECT_LOGGING_LEVEL, temporary_settings

    from flows.refresh import refresh
    from tests.fixtures.web_server import serving

    video = folder / "clip.mp4"
    trim(CLIP, 0.0, 1.0, video)
    listed, book = folder / "urls.txt", folder / "dances.yaml"
    dance = {"name": "Hips", "query": "hips", "source": "urls", "address": str(listed), "top": 9}
    book.write_text(yaml.safe_dump({"dances": [dance]}))
    with (
        temporary_settings({PREFECT_LOGGING_LEVEL: "ERROR"}),
        serving(video.read_bytes()) as web,
    ):
        plain, night = web.video, 0
        while True:
            night += 1
            web.video = plain + struct.pack(">I4sI", 12, b"free", night)
            listed.write_text(f"{web.url}/good/clip-{night}.mp4\n")
            asyncio.run(refresh(["Hips"], str(book), "finding", OVERRIDES, "smoke"))
            with (folder / "nights.txt").open("a") as file:
                file.write(f"{time.time()}\n")


class Watched:
    """A process with a home of its own, and all that it starts."""

    def __init__(self, folder: Path, words: list[str]) -> None:
        self.folder = folder
        for name in ("home", "tmp"):
            (folder / name).mkdir(parents=True)
        own = {"HOME": str(folder / "home"), "TMPDIR": str(folder / "tmp")}
        own |= {"ROBOJACKSON_STORE": f"{folder}/store", "PREFECT_HOME": f"{folder}/prefect"}
        own |= {"PREFECT_SERVER_EPHEMERAL_STARTUP_TIMEOUT_SECONDS": "300"}
        with (folder / "log.txt").open("ab") as log:
            self.process = subprocess.Popen(
                [sys.executable, "-m", *words], cwd=ROOT, stdout=log, stderr=log,
                env={**os.environ, **own, "PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1"},
            )  # fmt: skip

    def sample(self) -> dict[str, float]:
        """Return memory (proportional to what is shared: the sum is right), handles and disk."""
        pids = [found.pid for found in under(self.folder / "home")]
        disk = sum(f.lstat().st_size for f in self.folder.rglob("*") if _is_file(f))
        return {
            "memory_mb": sum(map(_memory_mb, pids)),
            "handles": sum(map(_handles, pids)),
            "disk_mb": disk / 1e6,
            "processes": len(pids),
        }

    def end(self) -> None:
        for found in under(self.folder / "home"):
            found.kill()
        self.process.wait()


def _is_file(path: Path) -> bool:
    with suppress(OSError):
        return path.is_file() and not path.is_symlink()
    return False


def _memory_mb(pid: int) -> float:
    with suppress(OSError, ValueError, IndexError):
        lines = Path(f"/proc/{pid}/smaps_rollup").read_text().splitlines()
        return float(next(line.split()[1] for line in lines if line.startswith("Pss:"))) / 1024
    return 0.0


def _handles(pid: int) -> int:
    with suppress(OSError):
        return len(os.listdir(f"/proc/{pid}/fd"))
    return 0


def soak(folder: Path, minutes: float) -> dict[str, list[dict[str, float]]]:
    """Run both for some time; return what was seen of each."""
    reference = base() / "reference.parquet"
    out = str(folder / "train" / "out")
    given = ["robojackson", "train", str(reference), "-o", out, "--minutes", str(2 * minutes)]
    watched = {
        "refresh": Watched(folder / "refresh", ["tests.chaos.soak", "--loop", f"{folder}/refresh"]),
        "train": Watched(folder / "train", [*given, "--force", "--trainer", "sb3"]),
    }
    began, seen = time.monotonic(), {name: [] for name in watched}
    try:
        while (now := time.monotonic() - began) < 60 * minutes:
            for name, each in watched.items():
                if each.process.poll() is not None:
                    raise SystemExit(f"{name} ended: {each.folder / 'log.txt'}")
                seen[name].append({"minute": now / 60, **each.sample()})
            time.sleep(EVERY_S)
    finally:
        for each in watched.values():
            each.end()
    return seen


def growth(rows: list[dict[str, float]], column: str) -> float:
    """Return how much a column grows in an hour, by a line through the second half."""
    half = rows[len(rows) // 2 :]
    slope = np.polyfit([row["minute"] for row in half], [row[column] for row in half], 1)[0]
    return float(60 * slope)


def draw(seen: dict[str, list[dict[str, float]]], file: Path) -> None:
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(len(COLUMNS), len(seen), figsize=(9, 6), sharex=True)
    for place, (name, rows) in enumerate(seen.items()):
        for (column, label), axis in zip(COLUMNS.items(), axes[:, place], strict=True):
            axis.plot([row["minute"] for row in rows], [row[column] for row in rows], lw=0.8)
            axis.set_ylim(bottom=0)
            axis.set_ylabel(label)
        axes[0, place].set_title(name)
        axes[-1, place].set_xlabel("minutes")
    figure.tight_layout()
    file.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(file, dpi=110)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--minutes", type=float, default=30.0)
    parser.add_argument("--folder", type=Path, default=None)
    parser.add_argument("--out", type=Path, default=RESULTS)
    parser.add_argument("--picture", type=Path, default=PICTURE)
    parser.add_argument("--loop", type=Path, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.loop:
        refresh_for_ever(options.loop)
    folder = options.folder or Path(tempfile.mkdtemp(prefix="robojackson-soak-"))
    seen = soak(folder.resolve(), options.minutes)
    nights = folder / "refresh" / "nights.txt"
    facts: dict[str, Any] = {
        "command": f"python -m tests.chaos.soak --minutes {options.minutes:g}",
        "refreshes": len(nights.read_text().splitlines()) if nights.exists() else 0,
        "growth_per_hour_in_second_half": {
            name: {column: round(growth(rows, column), 2) for column in COLUMNS}
            for name, rows in seen.items()
        },
        "samples": {
            name: [{key: round(value, 2) for key, value in row.items()} for row in rows[::12]]
            for name, rows in seen.items()
        },
    }
    options.out.write_text(json.dumps(facts, indent=1) + "\n")
    draw(seen, options.picture)
    print(json.dumps({key: facts[key] for key in list(facts)[:3]}, indent=1))


if __name__ == "__main__":
    main()
