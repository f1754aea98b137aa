"""Retargeting of the bundled clips: our solver beside the paper's mapping (`make bench`).

Each clip goes through our own mocap first. Rows: optimise (ours), paper (Table I literally) and
framefix (its axes and signs corrected, clipped to the limits). Figures are those of the score card;
frames/s counts source frames a CPU second of one core, all starts and the score card included.
"""

import argparse
import json
import time
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from benchmarks.truth import REAL, RENDERED, video_path
from configs.loader import load
from robojackson.clips.landmarks import detect
from robojackson.clips.video import VideoLimits, probe
from robojackson.mocap.recover import MocapConfig, recover
from robojackson.motion.smpl import SmplSequence
from robojackson.retarget import RetargetConfig, Robot, RobotDescription, load_robot, retarget

RESULTS = Path(__file__).parent / "results" / "retarget.json"
METHODS = ("optimise", "paper", "framefix")
COLUMNS = {
    "keypoint_mm": "keypoints mm",
    "keypoint_floor_mm": "floor mm",
    "bone_deg": "bones deg",
    "limit_violations": "over limit",
    "planted_slip_cm_s": "slip cm/s",
    "contact_gap_mm": "gap mm",
    "contact_share": "contact",
    "floor_penetration_mm": "in floor mm",
    "self_penetration_mm": "in self mm",
    "hinge_jerk_rms_rad_s3": "jerk rad/s3",
    "torque_over_share": "over torque",
    "seam_deg": "seam deg",
    "lean_deg": "lean deg",
    "passed": "passed",
}


def measure(clip: str, robot: Robot, size: str) -> list[dict[str, Any]]:
    """One row a method."""
    path = video_path(clip)
    sequence = recover(detect(path, probe(path, VideoLimits()), size), MocapConfig())
    return [_row(clip, sequence, robot, method) for method in METHODS]


def _row(clip: str, sequence: SmplSequence, robot: Robot, method: str) -> dict[str, Any]:
    started = time.process_time()
    config = RetargetConfig(method=method)  # type: ignore[arg-type]
    card = dict(retarget(sequence, robot, config).scorecard)
    seconds = time.process_time() - started
    return {"clip": clip, "method": method, "frames_per_s": len(sequence) / seconds, **card}


def table(rows: list[dict[str, Any]]) -> Table:
    """The rows as text."""
    out = Table("clip", "method", *COLUMNS.values(), "frames/s", title="Retargeting")
    for row in rows:
        figures = [f"{row[key]:.3g}" if key in row else "-" for key in COLUMNS]
        out.add_row(row["clip"], row["method"], *figures, f"{row['frames_per_s']:.0f}")
    return out


def main(arguments: list[str] | None = None) -> None:
    """Measure, print, write."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--clips", nargs="*", default=[*RENDERED, *REAL])
    parser.add_argument("--robot", default="humanoid")
    parser.add_argument("--size", default="full", help="pose model: lite, full or heavy")
    parser.add_argument("--out", type=Path, default=RESULTS)
    options = parser.parse_args(arguments)
    robot = load_robot(load(RobotDescription, f"robots/{options.robot}"))
    rows = [row for clip in options.clips for row in measure(clip, robot, options.size)]
    Console(width=200).print(table(rows))
    options.out.parent.mkdir(parents=True, exist_ok=True)
    options.out.write_text(json.dumps({"size": options.size, "rows": rows}, indent=1) + "\n")


if __name__ == "__main__":
    main()
