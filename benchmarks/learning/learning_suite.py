"""Measure cost and results of learning (`make bench-learning`).

    python -m benchmarks.learning.learning_suite PART ... [--folder FOLDER]

`speed`, `threads`: our parts beside their peers (`speed`). `policies`: one row a move
and a seed, trained for the row's CPU minutes and evaluated on stock physics (`training_rows`).
`survival`, `pretraining`: races (`races`). `checkpoints`: what they cost a training
(`checkpoint_cost`). `table` only prints what there is, and
writes the G1's rows into `docs/benchmarks_learning.md`. What exists is not computed again, so
that all of it may take several sittings. The authors' clips are measured where ROBOJACKSON_PAPER
names their folder.
"""

import argparse
import json
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from benchmarks.learning import checkpoint_cost, races, training_rows
from benchmarks.learning import speed as learning_speed
from benchmarks.learning.error_line import errors_in_one_line
from benchmarks.learning.policies import TRAINED, Folders
from benchmarks.learning.rows.g1_rows_table import update_document
from benchmarks.learning.rows.row_bars import LIMBS, USUAL
from benchmarks.learning.summary import AUTHORS_ROBOT, COLUMNS, summary

PARTS = ("speed", "threads", "policies", "survival", "pretraining", "checkpoints", "table")
SPEED = ("what", "ours", "peer", "ratio", "bar", "holds", "load_average")
POLICY = (
    *("move", "horizon_s", "seeds", "steps", "strict_success", "strict_success_95", "worst_seed"),
    *("skill", "velocity_score", "survived_s", "reference", "forced", "holds"),
)


def main() -> None:
    """Measure the requested parts and print all rows."""
    given = _arguments()
    folders = Folders.at(given.folder)
    parts = given.what or list(PARTS)
    command = f"python -m benchmarks.learning.learning_suite {' '.join(sys.argv[1:])}".strip()
    speed = folders.results / "learning_speed.json"
    if "threads" in parts:
        _write(speed, [learning_speed.threads()], command)
    if "speed" in parts:
        _write(speed, learning_speed.speed(given.repeats, given.seconds), command)
    if "survival" in parts:
        _write(speed, [races.survival(folders, given.cpu_minutes or 10)], command)
    if "pretraining" in parts:
        minutes = given.cpu_minutes or 5
        row = races.pretraining(folders, given.seeds, minutes, given.walker_cpu_seconds)
        _write(speed, [row], command)
    if "checkpoints" in parts:
        _write(speed, [checkpoint_cost.checkpoints(folders)], command)
    if "policies" in parts:
        minutes, jobs = given.cpu_minutes, given.jobs
        training_rows.policies(given.moves, given.seeds, minutes, jobs, folders, given.by_steps)
    if {"policies", "table"} & set(parts) and (rows := summary(folders)):
        held = {"command": command, "authors_robot": AUTHORS_ROBOT, "rows": rows}
        (folders.results / "learning.json").write_text(json.dumps(held, indent=1) + "\n")
        if given.folder is None:
            update_document(rows)
    _show(folders, Console())


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("what", choices=PARTS, nargs="*", metavar="PART")
    parser.add_argument("--folder", type=Path, help="for everything, instead of the usual places")
    parser.add_argument("--moves", nargs="*", default=list(TRAINED), choices=list(TRAINED))
    parser.add_argument("--seeds", nargs="*", type=int, default=[0, 1, 2, 3, 4])
    parser.add_argument("--jobs", type=int, default=1, help="trainings at a time, each on a core")
    parser.add_argument(
        "--cpu-minutes",
        type=float,
        help="not the row's own; such policies are in no table but that of polish_rows",
    )
    parser.add_argument(
        "--by-steps",
        action="store_true",
        help="budget of policies in steps alone, where a CPU minute is fewer than 50,000",
    )
    parser.add_argument("--walker-cpu-seconds", type=float, help="what the walker took to train")
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--seconds", type=float, default=4.0, help="of CPU a turn")
    return parser.parse_args()


def _write(path: Path, rows: list[dict[str, Any]], command: str) -> None:
    """Replace the rows of the same comparisons."""
    old = json.loads(path.read_text()) if path.exists() else []
    named = {row["what"]: row for row in old} | {
        row["what"]: {**row, "command": command} for row in rows
    }
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(list(named.values()), indent=1) + "\n")


def _show(folders: Folders, console: Console) -> None:
    speed, policies = (folders.results / f"{name}.json" for name in ("learning_speed", "learning"))
    if speed.exists():
        console.print(_table("Speed", SPEED, json.loads(speed.read_text())))
    if policies.exists():
        rows = json.loads(policies.read_text())["rows"]
        console.print(_table("Policies", POLICY, rows))
        console.print(_limbs(rows))
        console.print(_beside(rows))
        for row in rows:
            missed = [name for name, held in row["bars"].items() if not held]
            console.print(
                f"{_name(row)}: {'missed: ' + ', '.join(missed) if missed else 'all held'}"
            )


def _table(title: str, columns: tuple[str, ...], rows: list[dict[str, Any]]) -> Table:
    table = Table(*columns, title=title)
    for row in rows:
        table.add_row(*(_cell(row.get(column)) for column in columns))
    return table


def _limbs(rows: list[dict[str, Any]]) -> Table:
    """Return the gain, R2 and excess speed of every limb, with a mark where the bar is missed."""
    (low, high), r2, excess = USUAL.gain, USUAL.r2, USUAL.excess
    title = f"gain {low}-{high} / R2 >= {r2} / excess <= {excess}, where a limb has a bar"
    table = Table("move", *LIMBS, title=title)
    for row in rows:
        cells = []
        for limb in LIMBS:
            figures = [_cell(row[kind][limb]) for kind in ("limb_gain", "limb_r2", "excess_speed")]
            missed = any(not held for bar, held in row["bars"].items() if f" {limb} " in f"{bar} ")
            cells.append(" / ".join(figures) + (" !" if missed else ""))
        table.add_row(_name(row), *cells)
    return table


def _beside(rows: list[dict[str, Any]]) -> Table:
    """Return the baselines that do not dance, and the authors' robot."""
    table = Table("move", "who", *COLUMNS, title="Beside the policy")
    for row in rows:
        for who, figures in row["beside"].items():
            table.add_row(_name(row), who, *(_cell(figures[key]) for key in COLUMNS))
    table.add_row(
        "authors' logs", "authors' robot", _cell(AUTHORS_ROBOT["survived_s"]), "-", "-", "-"
    )
    return table


def _name(row: Mapping[str, Any]) -> str:
    seconds, stale = row["horizon_s"], row.get("stale_seeds")
    name = f"{row['move']} {seconds:g} s" if seconds else f"{row['move']} to its end"
    return name + (f" (on an older reference: seeds {stale})" if stale else "")


def _cell(value: object) -> str:
    if isinstance(value, list):
        return "-".join(_cell(item) for item in value)
    return "-" if value is None else f"{value:.3g}" if isinstance(value, float) else str(value)


if __name__ == "__main__":
    with errors_in_one_line():
        main()
