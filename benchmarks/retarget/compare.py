"""Retargeting: our solver beside the paper's mapping and per-frame inverse kinematics by mink.

`make bench-retarget`. Sources: `mocap`, the bundled clips through our own mocap; `truth`, the bones
of the bodies that the rendered clips show; `paper`, the authors' files where ROBOJACKSON_PAPER
names their folder. Methods: `optimise` (ours at the tempo of the clip, no repair), `auto` (ours,
slowed and repaired for the dynamics), `paper` (Table I literally), `framefix` (axes and signs
corrected), `mink`, `mink 6 Hz`; targets are the same for all. Figures are those of the score card;
speed is source frames a CPU second of one core, all starts and the score card included.
"""

import argparse
import json
import os
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from benchmarks.mocap.truth import REAL, RENDERED, video_path
from benchmarks.retarget import mink_peer
from benchmarks.retarget.truth_motions import lengthened, truth_motion
from robojackson.cli import importing, stages
from robojackson.errors import BadConfiguration, MissingDependency
from robojackson.motion.smpl_sequence import SmplSequence
from robojackson.pipeline.robot_descriptions import describe_robot
from robojackson.retarget.retarget_config import RepairConfig, RetargetConfig
from robojackson.retarget.retargeting import assemble, retarget_motion
from robojackson.retarget.targets.cycle import human_clip
from robojackson.retarget.targets.keypoint_targets import targets
from robojackson.robot.model import Robot, load_robot

RESULTS = Path(__file__).parents[1] / "results" / "retarget.json"
TRUTH = ("walk", "dance_a", "dance_b", "spin")
METHODS = ("optimise", "mink", "auto", "paper", "framefix")
PAPER = "ROBOJACKSON_PAPER"
LENGTHS_S = (10.0, 60.0)
PLAIN: dict[str, Any] = {"tempo": 1.0, "repair": RepairConfig(target_share=0.0)}
COLUMNS = {
    "keypoint_mm": "keypoints mm",
    "keypoint_leaned_mm": "leaned mm",
    "keypoint_floor_mm": "floor mm",
    "keypoint_jerk_m_s3": "jerk m/s3",
    "source_jerk_m_s3": "source",
    "hinge_jerk_rms_rad_s3": "hinge jerk",
    "limit_violations": "over limit",
    "planted_slip_cm_s": "slip cm/s",
    "planted_slip_p95_cm_s": "p95",
    "contact_share": "contact",
    "contact_gap_mm": "gap mm",
    "floor_penetration_mm": "floor pen.",
    "self_penetration_mm": "self pen.",
    "joint_speed_max_rad_s": "rad/s",
    "lean_deg": "lean",
    "frames_per_s": "frames/s",
}


@dataclass(frozen=True)
class Case:
    """One motion to retarget.

    Attributes:
        source: mocap, truth or paper.
        clip: Name of the clip.
        sequence: The human.
    """

    source: str
    clip: str
    sequence: SmplSequence


def cases(folder: Path, clips: list[str]) -> Iterator[Case]:
    """Yield motions of our own mocap, kept in a folder; truths; the authors' files."""
    for clip in (*RENDERED, *REAL):
        if clip in clips:
            table = folder / clip / "smpl.parquet"
            if not table.is_file():
                stages.mocap(video_path(clip), folder / clip, "base", {})
            yield Case("mocap", clip, SmplSequence.load(table))
    yield from (Case("truth", clip, truth_motion(clip)) for clip in TRUTH if clip in clips)
    if root := os.environ.get(PAPER):
        for file in sorted(Path(root).glob("*.pt")):
            out = folder / f"paper_{file.stem}"
            importing.import_motion(file, out, None, None, "base", {})
            sequence = SmplSequence.load(out / "smpl.parquet")
            yield Case("paper", file.stem, sequence)


def rows_of(case: Case, robot: Robot, methods: list[str]) -> Iterator[dict[str, Any]]:
    """Yield one row a method; mink on the truths, the paper's mapping on our own mocap."""
    peer, stock = case.source == "truth", robot.description.name == "humanoid"
    if "optimise" in methods:
        plain = RetargetConfig(**(PLAIN | {"cyclic": "no" if peer else "auto"}))
        yield _row(case, robot, "optimise", plain)
    if peer and "mink" in methods:
        yield from _peer_rows(case, robot)
    if case.source != "mocap" or not stock:
        return
    if "auto" in methods and case.clip in RENDERED:
        yield _row(case, robot, "auto", RetargetConfig())
    for method in {"paper", "framefix"} & set(methods):
        yield _row(case, robot, method, RetargetConfig(**PLAIN | {"method": method}))


def _row(case: Case, robot: Robot, method: str, config: RetargetConfig) -> dict[str, Any]:
    started = time.process_time()
    card = retarget_motion(case.sequence, robot, config).scorecard
    return _told(case, robot, method, card, time.process_time() - started)


def _peer_rows(case: Case, robot: Robot) -> Iterator[dict[str, Any]]:
    config = RetargetConfig(cyclic="no", **PLAIN)
    clip, _ = human_clip(case.sequence, robot.description.control_dt, "no", 1.0, config.cycle)
    aims = targets(clip, robot)
    one_ball = len(set(robot.contact_keypoints.tolist())) == len(robot.contact_keypoints)
    for name, lock in (("mink", False), *([("mink + lock", True)] if one_ball else [])):
        started = time.process_time()
        raw = mink_peer.per_frame(robot, aims, lock)
        seconds = time.process_time() - started
        smooth = mink_peer.filtered(robot, raw, aims.dt)
        for method, qpos in ((name, raw), (f"{name}, 6 Hz", smooth)):
            motion = assemble(qpos, clip.time_s, aims, aims, robot, {}, config.weights.tolerance)
            yield _told(case, robot, method, motion.scorecard, seconds)


def _told(case: Case, robot: Robot, method: str, card: Any, seconds: float) -> dict[str, Any]:
    return {
        "robot": robot.description.name,
        "source": case.source,
        "clip": case.clip,
        "method": method,
        **{key: value for key, value in card.items() if isinstance(value, float)},
        "frames_per_s": len(case.sequence) / seconds,
    }


def speeds(robot: Robot, clip: str = "dance_a") -> dict[str, float]:
    """Return CPU seconds of a 30 fps clip of 10 s and of 60 s, and their ratio; the best of
    three."""
    human, config = truth_motion(clip), RetargetConfig(cyclic="no", **PLAIN)
    best = dict.fromkeys(LENGTHS_S, np.inf)
    for _ in range(3):
        for seconds in LENGTHS_S:
            sequence = lengthened(human, seconds)
            started = time.process_time()
            retarget_motion(sequence, robot, config)
            best[seconds] = min(best[seconds], time.process_time() - started)
    short, long = (best[seconds] for seconds in LENGTHS_S)
    frames = round(LENGTHS_S[0] * 30)
    return {"cpu_10_s": short, "cpu_60_s": long, "ratio": long / short, "fps": frames / short}


def table(rows: list[dict[str, Any]]) -> Table:
    """Return the rows as text."""
    out = Table("robot", "source", "clip", "method", *COLUMNS.values(), title="Retargeting")
    for row in rows:
        figures = [f"{row[key]:.3g}" if key in row else "-" for key in COLUMNS]
        out.add_row(row["robot"], row["source"], row["clip"], row["method"], *figures)
    return out


def markdown(rows: list[dict[str, Any]]) -> str:
    """Return the rows for docs/benchmarks_retarget.md."""
    names = ["robot", "source", "clip", "method"]
    lines = ["| " + " | ".join([*names, *COLUMNS.values()]) + " |"]
    lines.append("|---" * (len(names) + len(COLUMNS)) + "|")
    for row in rows:
        figures = [f"{row[key]:.3g}" if key in row else "-" for key in COLUMNS]
        lines.append("| " + " | ".join([*(row[name] for name in names), *figures]) + " |")
    return "\n".join(lines) + "\n"


def _robots(names: list[str], console: Console) -> Iterator[Robot]:
    for name in names:
        try:
            yield load_robot(describe_robot(name))
        except BadConfiguration as cause:
            console.print(f"left out: {cause}")


def main(arguments: list[str] | None = None) -> None:
    """Measure, print, write."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--clips", nargs="*", default=[*RENDERED, *REAL, "spin"])
    parser.add_argument("--robots", nargs="*", default=["humanoid", "g1"])
    parser.add_argument("--methods", nargs="*", default=list(METHODS))
    parser.add_argument("--folder", type=Path, default=Path("store/bench-retarget"))
    parser.add_argument("--out", type=Path, default=RESULTS)
    options = parser.parse_args(arguments)
    console, rows, speed = Console(width=230), [], {}
    for robot in _robots(options.robots, console):
        for case in cases(options.folder, options.clips):
            try:
                for row in rows_of(case, robot, options.methods):
                    rows.append(row)
                    console.log(f"{row['robot']} {row['source']} {row['clip']} {row['method']}")
            except MissingDependency as cause:
                console.print(str(cause))
        speed[robot.description.name] = speeds(robot)
    console.print(table(rows))
    console.print(speed)
    options.out.parent.mkdir(parents=True, exist_ok=True)
    options.out.write_text(json.dumps({"rows": rows, "speed": speed}, indent=1) + "\n")
    options.out.with_suffix(".md").write_text(markdown(rows))


if __name__ == "__main__":
    main()
