"""Performances: stand, hip_shake, dance_b, walk, stand, pushed, 40 runs of every tracker here.

    python -m benchmarks.learning.performance_rows [--runs 40] [--trackers NAME ...]

What exists is not computed again. Where trackers are: `benchmarks.learning.tracker_rows`.
"""

import argparse
import json
import time
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from benchmarks.learning.policies import FROZEN, Folders, require_frozen
from benchmarks.learning.tracker_rows import present
from robojackson.api.performances import perform
from robojackson.files.json_types import to_json_types
from robojackson.motion.reference_motion import ReferenceMotion, poses_sha256
from robojackson.pipeline.tracker_descriptions import default_trackers
from robojackson.rl.config.performance_config import PerformanceConfig

ROBOT = "g1"
DANCES = ("g1_hip_shake", "g1_dance_b", "g1_walk")
BAR = 0.95
"""Share of runs that end standing."""
SHOWN = ("tracker", "pushes", "runs", "finished", "uninterrupted", "danced_share", "mpjpe_l_m")


def main() -> None:
    """Measure every row that is not there and print all."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--trackers", nargs="*", default=[t.name for t in default_trackers(ROBOT)])
    parser.add_argument("--runs", type=int, default=40)
    parser.add_argument("--pushes", type=float, nargs="*", default=[1.0])
    parser.add_argument("--folder", type=Path, help="for everything, instead of the usual places")
    given = parser.parse_args()
    path = Folders.at(given.folder).results / "performance.json"
    rows = json.loads(path.read_text())["rows"] if path.is_file() else []
    for tracker in given.trackers:
        for pushes in given.pushes:
            rows += measured(tracker, pushes, given.runs, rows)
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(json.dumps(to_json_types({"bar": BAR, "rows": rows}), indent=1) + "\n")
    table = Table(*SHOWN, title=f"Stand, {', '.join(DANCES)}, stand; bar: {BAR:.0%} finished")
    for row in rows:
        cells = [row[key] for key in SHOWN]
        table.add_row(*(f"{c:.3g}" if isinstance(c, float) else str(c) for c in cells))
    Console(width=160).print(table)


def measured(
    name: str, pushes: float, runs: int, held: list[dict[str, Any]]
) -> list[dict[str, Any]]:
    """Return the row of a tracker, if it is here and not held yet."""
    motions = {}
    for move in DANCES:
        require_frozen(move, FROZEN / f"{move}.parquet")
        motions[move] = ReferenceMotion.load(FROZEN / f"{move}.parquet")
    poses = [poses_sha256(motion) for motion in motions.values()]
    key = (name, pushes, runs, poses)
    known = [(row["tracker"], row["pushes"], row["runs"], row["poses"]) for row in held]
    tracker = None if key in known else present(name)
    if tracker is None:
        return []
    began = time.process_time()
    config = PerformanceConfig(runs=runs, pushes=pushes)
    done = perform([FROZEN / f"{move}.parquet" for move in DANCES], tracker=tracker, config=config)
    spent = time.process_time() - began
    return [{**done.summary, "poses": poses, "cpu_s": spent, "parts": done.parts, "all": done.runs}]


if __name__ == "__main__":
    main()
