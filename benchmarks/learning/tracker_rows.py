"""Trackers on the references of the benchmark, with our evaluation: no training at all.

    python -m benchmarks.learning.tracker_rows [--moves g1_walk ...] [--friction 1] [--folder F]

A row is a tracker, a reference motion at its own tempo and a friction; what exists with all figures
is not computed again. A tracker is measured where its file is: in the store (`robojackson trackers
add`), or in the folder that ROBOJACKSON_TRACKERS names. Motions of others' files are measured where
ROBOJACKSON_PAPER and ROBOJACKSON_CMU name their folders. `replay` is no tracker but the reference
itself as targets that lead by its torques, with the robot's own gains and no feedback.
"""

import argparse
import json
import os
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from benchmarks.learning.error_line import errors_in_one_line
from benchmarks.learning.policies import (
    FROZEN,
    MOVES,
    Folders,
    reference_of,
    require_frozen,
    source_of,
)
from robojackson.api.robots import load_robot
from robojackson.errors import BadConfiguration, BadPolicy
from robojackson.motion.reference_motion import ReferenceMotion, poses_sha256
from robojackson.pipeline.tracker_descriptions import describe_tracker, tracker_names
from robojackson.rl.config.evaluate_config import TRAINED, EvaluateConfig
from robojackson.rl.evaluation.policy_evaluation import evaluate_policy
from robojackson.rl.sim.variation import Variation, varied
from robojackson.rl.trackers.regulator_tracker import RegulatorTracker
from robojackson.rl.trackers.tracker import Tracker
from robojackson.rl.trackers.tracker_file import open_tracker

FILES = "ROBOJACKSON_TRACKERS"
"""Variable that names a folder with the files of trackers."""
FRICTIONS = (1.0, 0.6)
"""Of the soles on the floor; the second is what mjlab trains with."""
EVALUATION = EvaluateConfig(resets=1)
"""24 phases and the stand."""
FIGURES = (
    *("survived_s", "success", "strict_success", "skill", "site_error_m", "mpjpe_l_m"),
    *("mpjpe_l_alive_m", "mpjpe_g_alive_m", "drift_m", "limb_gain", "acceleration_ratio"),
    "velocity_score",
)
FEET = ("excess_speed_left_foot", "excess_speed_right_foot")
"""Speeds whose mean is `feet_excess_m_s`."""
WHOLE = (*FIGURES, "feet_excess_m_s", "survived_10_s")
"""Figures of a complete row; one without them is measured again."""
LABELS = ("tracker", "move", "friction", "poses")
REPLAY, RESULTS = "replay", "trackers.json"
SHOWN = ("tracker", "move", "friction", *WHOLE, "cpu_s")
SURVIVED_S = 10.0
"""Time of the share of starts that survive so long, or to the end of a shorter motion."""


def main() -> None:
    """Measure every row that is not there and print all."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--moves", nargs="*", default=moves_here(), choices=sorted(MOVES))
    parser.add_argument("--friction", nargs="*", type=float, default=FRICTIONS)
    names = [*tracker_names(), REPLAY]
    parser.add_argument("--trackers", nargs="*", default=names, choices=names)
    parser.add_argument("--folder", type=Path, help="for everything, instead of the usual places")
    given = parser.parse_args()
    folders = Folders.at(given.folder)
    path, held = folders.results / RESULTS, held_in(folders)
    command = f"python -m benchmarks.learning.tracker_rows {' '.join(sys.argv[1:])}".strip()
    requested = (given.moves, given.trackers, given.friction)
    for row in measured(*requested, held, folders):
        held = [*(one for one in held if labels_of(one) != labels_of(row)), row]
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps({"command": command, "rows": held}, indent=1) + "\n")
    _show(held)


def held_in(folders: Folders) -> list[dict[str, Any]]:
    """Return the rows that are measured."""
    path = folders.results / RESULTS
    rows: list[dict[str, Any]] = json.loads(path.read_text())["rows"] if path.is_file() else []
    return rows


def moves_here() -> list[str]:
    """Return the moves that have a frozen reference, or whose file of others is here."""
    found = [(name, move) for name, move in MOVES.items() if not move.same_as]
    return [
        name
        for name, move in found
        if (FROZEN / f"{name}.parquet").is_file()
        or (move.is_foreign and source_of(move) is not None)
    ]


def labels_of(row: Mapping[str, Any]) -> tuple[Any, ...]:
    """Return tracker, move, friction and poses of a row."""
    return tuple(row[name] for name in LABELS)


def measured(
    moves: Sequence[str],
    trackers: Sequence[str],
    frictions: Sequence[float],
    held: list[dict[str, Any]],
    folders: Folders,
) -> Iterator[dict[str, Any]]:
    """Yield rows that are not held yet with all figures, of the trackers that are here."""
    known = {labels_of(row) for row in held if all(name in row for name in WHOLE)}
    for name in trackers:
        tracker = present(name)
        for move in moves if tracker is not None else ():
            if tracker is None or MOVES[move].robot != tracker.description.robot:
                continue
            motion = ReferenceMotion.load(frozen_or_made(move, folders))
            for friction in frictions:
                key = (name, move, friction, poses_sha256(motion))
                if key not in known:
                    yield dict(zip(LABELS, key, strict=True)) | evaluated(tracker, motion, friction)


def frozen_or_made(move: str, folders: Folders) -> Path:
    """Return the frozen reference of a move, or the one made from a file that is not ours."""
    frozen = FROZEN / f"{move}.parquet"
    if not frozen.is_file():
        return reference_of(move, folders)
    require_frozen(move, frozen)
    return frozen


def evaluated(tracker: Tracker, motion: ReferenceMotion, friction: float) -> dict[str, Any]:
    """Return the figures of a tracker on one motion."""
    robot = load_robot(tracker.description.robot)
    usual = robot.description.simulation.friction
    if usual is None:
        raise BadConfiguration(f"robot {motion.robot!r} does not give its friction")
    began = time.process_time()
    found = evaluate_policy(
        tracker, motion, varied(robot, Variation(friction=friction / usual)), EVALUATION
    )
    figures = {name: found.summary[name] for name in FIGURES}
    figures["feet_excess_m_s"] = float(np.mean([found.summary[name] for name in FEET]))
    pinned = tracker.description.file
    facts = {"sha256": pinned.sha256 if pinned else "", "steps": len(motion), "dt": motion.dt}
    own = [row for row in found.rows if row["policy"] == TRAINED]
    lasted = {"survived_10_s": float(np.mean([lasts(row, SURVIVED_S) for row in own]))}
    return {**facts, "starts": len(own), **figures, **lasted, "cpu_s": time.process_time() - began}


def lasts(row: Mapping[str, Any], seconds: float) -> bool:
    """Return whether a robot stayed up for so long, or to the end of a shorter motion."""
    return not row["fell"] or row["survived_s"] >= seconds


def present(name: str) -> Tracker | None:
    """Return a tracker whose file is here; None, with a line why, where it is not."""
    if name == REPLAY:
        return bare_replay()
    description = describe_tracker(name)
    folder = os.environ.get(FILES)
    pinned = description.file
    file = Path(folder) / pinned.name if folder and pinned and pinned.url else None
    try:
        return open_tracker(description, file)
    except BadPolicy as cause:
        print(cause, file=sys.stderr)
        return None


def bare_replay() -> Tracker:
    """Return the reference as a tracker: the regulator without its feedback."""
    found = RegulatorTracker(replace(describe_tracker("regulator"), name=REPLAY))
    found.control = replace(found.control, feedback=0.0)
    return found


def _show(rows: list[dict[str, Any]]) -> None:
    table = Table(*SHOWN, title="Trackers, not trained on these motions")
    for row in rows:
        cells = [row.get(key, "") for key in SHOWN]
        table.add_row(*(f"{c:.3g}" if isinstance(c, float) else str(c) for c in cells))
    Console(width=200).print(table)


if __name__ == "__main__":
    with errors_in_one_line():
        main()
