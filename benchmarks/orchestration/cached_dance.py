"""Time of a cached dance: from its records, and through the flow.

    python -m benchmarks.orchestration.cached_dance [--runs 5]

Both answer the same command for the same store, by turns. Through the flow, Prefect and its
temporary server are started and every task is read from the cache. Writes
`benchmarks/results/cached_dance.json`: wall and processor time, seconds, minimum and median.
"""

import argparse
import json
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
RESULTS = ROOT / "benchmarks" / "results" / "cached_dance.json"
CLIP = "clips/hip_shake.mp4"
OVERRIDES = {"train.steps": 300, "train.trainer": "sb3"}
"""The training is short: what is measured does not train."""
COMMAND = [sys.executable, "-m", "robojackson", "dance", CLIP, "--config", "smoke"]
COMMAND += [word for key, value in OVERRIDES.items() for word in ("--set", f"{key}={value}")]
FLOW = f"""
from flows.runtime.environment import prepare
from storage.store import Store
prepare(Store.from_environment())
from flows.dance import run
run({CLIP!r}, "smoke", {OVERRIDES!r})
"""
WAYS = {"records": COMMAND, "flow": [sys.executable, "-c", FLOW]}


def timed(command: list[str], environment: dict[str, str]) -> tuple[float, float]:
    """Return the wall and the processor time of a command with its children, seconds."""
    began, before = time.monotonic(), _processor_s()
    subprocess.run(command, env=environment, cwd=ROOT, check=True, capture_output=True)
    return time.monotonic() - began, _processor_s() - before


def _processor_s() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def measured(runs: int) -> dict[str, Any]:
    """Return the figures of both ways."""
    with tempfile.TemporaryDirectory(prefix="robojackson-cached-") as folder:
        fixed = {"ROBOJACKSON_STORE": str(Path(folder) / "store"), "OMP_NUM_THREADS": "1"}
        kept = {k: v for k, v in os.environ.items() if not k.startswith("PREFECT_")}
        environment = {**kept, **fixed, "PYTHONPATH": str(ROOT)}
        subprocess.run(COMMAND, env=environment, cwd=ROOT, check=True)
        seconds: dict[str, list[tuple[float, float]]] = {name: [] for name in WAYS}
        for _ in range(runs):
            for name, command in WAYS.items():
                seconds[name].append(timed(command, environment))
    rows = {name: _row(found) for name, found in seconds.items()}
    ratio = rows["flow"]["wall_median_s"] / rows["records"]["wall_median_s"]
    return {"runs": runs, **rows, "ratio": round(ratio, 2)}


def _row(found: list[tuple[float, float]]) -> dict[str, float]:
    wall, processor = zip(*found, strict=True)
    figures = {
        "wall_min_s": min(wall),
        "wall_median_s": statistics.median(wall),
        "processor_median_s": statistics.median(processor),
    }
    return {name: round(value, 2) for name, value in figures.items()}


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--runs", type=int, default=5)
    made = measured(parser.parse_args().runs)
    RESULTS.write_text(json.dumps(made, indent=1) + "\n")
    print(json.dumps(made, indent=1))


if __name__ == "__main__":
    main()
