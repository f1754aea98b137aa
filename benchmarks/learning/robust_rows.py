"""Policies of `train --robust` and the passports that they keep, one row a move and a seed.

    python -m benchmarks.learning.robust_rows [--moves g1_walk ...] [--seeds 100] [--folder F]

A training gets the budget of the move's row with the full state, in control steps, though it sees a
robot's own measurements, and is pinned to `--core`. What exists is not computed again, and an
interrupted training goes on. Motions of others' files are measured where ROBOJACKSON_PAPER and
ROBOJACKSON_CMU name their folders.
"""

import argparse
import json
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from benchmarks.learning.error_line import errors_in_one_line
from benchmarks.learning.policies import MOVES, Folders, load, must, reference_of, source_of
from benchmarks.learning.training_rows import STEPS_A_MINUTE
from robojackson.files.file_tree import FileTree
from robojackson.motion.reference_motion import poses_sha256
from robojackson.pipeline.folder_lock import locked
from robojackson.report.quantities import format_value
from robojackson.rl.evaluation.passport import LEAST_SHARE

TRAINED = [
    name
    for name, move in MOVES.items()
    if move.robot == "g1" and move.trained and move.observation == "full"
]
DEFAULT = ("g1_hip_shake", "g1_authors_apt1", "g1_walk", "g1_authors_walk", "g1_dance_b")
FIGURES = ("strict_success", "success", "skill", "survived_s", "mpjpe_l_m", "acceleration_ratio")
"""Of an evaluation: 24 phases x 3 resets and the stand."""
CASE = ("case", "strict_success", "success", "skill", "survived_s", "kept", "robust")
"""Of a case of the passport: 24 phases and the stand."""


def main() -> None:
    """Measure every row that is not there and print all."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--moves", nargs="*", default=list(DEFAULT), choices=TRAINED)
    parser.add_argument("--seeds", nargs="*", type=int, default=[100])
    parser.add_argument("--core", type=int, help="of the processor; any when not given")
    parser.add_argument("--folder", type=Path, help="for everything, instead of the usual places")
    given = parser.parse_args()
    folders = Folders.at(given.folder)
    path = folders.results / "robust.json"
    for name in given.moves:
        for seed in given.seeds:
            if source_of(MOVES[name]) is None:
                print(f"{name}: the file that it is made from is not here")
            elif not _is_held(path, name, seed):
                _keep(path, measured(name, seed, folders, given.core))
    _show(_rows(path))


def measured(name: str, seed: int, folders: Folders, core: int | None) -> dict[str, Any]:
    """Train a policy robustly, evaluate it with its passport, and return the row."""
    reference = reference_of(name, folders)
    steps = round(STEPS_A_MINUTE * MOVES[name].cpu_minutes)
    out = folders.work / name / f"robust-s{seed}"
    train = ("train", reference, "-o", out, "--robust", "--steps", steps, "--seed", seed)
    must(*train, "--move", name, "--force", core=core)
    policy, evaluated = out / "policy.safetensors", out / "evaluated"
    if not (evaluated / "evaluation.json").is_file():
        must("evaluate", policy, reference, "-o", evaluated, "--passport", core=core)
    found = json.loads((evaluated / "evaluation.json").read_text())
    return {
        "move": name,
        "seed": seed,
        "steps": steps,
        "poses": poses_sha256(load(reference)),
        **{key: found[key] for key in FIGURES},
        "robust": found["robust"],
        "passport": [{key: case[key] for key in CASE} for case in found["passport"]],
    }


def missed(row: dict[str, Any]) -> list[dict[str, Any]]:
    """Return the cases of a row that keep less than nine tenths of the nominal strict success."""
    return [case for case in row["passport"] if not case["robust"]]


def _rows(path: Path) -> list[dict[str, Any]]:
    rows: list[dict[str, Any]] = json.loads(path.read_text())["rows"] if path.is_file() else []
    return rows


def _is_held(path: Path, name: str, seed: int) -> bool:
    return any((row["move"], row["seed"]) == (name, seed) for row in _rows(path))


def _keep(path: Path, row: dict[str, Any]) -> None:
    """Add a row to the file, which rows of another core reach, too."""
    with locked(path.parent, "robust.lock", patience_s=60.0, holder="another row"):
        rows = [*_rows(path), row]
        rows.sort(key=lambda one: (list(MOVES).index(one["move"]), one["seed"]))
        text = json.dumps({"least_kept": LEAST_SHARE, "rows": rows}, indent=1) + "\n"
        FileTree(path.parent).write(path.name, text.encode())


def _show(rows: list[dict[str, Any]]) -> None:
    columns = ("move", "seed", "steps", "strict", "skill", "mpjpe_l", "cases kept", "not kept")
    table = Table(*columns, title=f"train --robust; bar: every case keeps {LEAST_SHARE:.0%}")
    for row in rows:
        cases = row["passport"]
        names = "; ".join(f"{case['case']} {case['strict_success']:.0%}" for case in missed(row))
        table.add_row(
            row["move"], str(row["seed"]), f"{row['steps']:,}", f"{row['strict_success']:.1%}",
            *(format_value(name, row[name]) for name in ("skill", "mpjpe_l_m")),
            f"{len(cases) - len(missed(row))} of {len(cases)}", names,
        )  # fmt: skip
    Console(width=180).print(table)


if __name__ == "__main__":
    with errors_in_one_line():
        main()
