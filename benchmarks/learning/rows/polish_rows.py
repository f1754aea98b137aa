"""What five CPU-minutes of training on the feedback give, beside the full time with the same seeds.

    python -m benchmarks.learning.learning_suite policies --cpu-minutes 5 --by-steps --moves M ...
    python -m benchmarks.learning.rows.polish_rows [--folder F]

The bars are those that the full time has. Differences are paired: a seed is one sample. The second
command reads kept rows, writes `benchmarks/results/learning_polish.json`, and replaces the table of
`docs/benchmarks_learning.md`.
"""

import argparse
import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.learning.policies import HORIZONS_S, MOVES, Folders
from benchmarks.learning.rows.g1_rows_table import markdown_table, replace_table
from benchmarks.learning.rows.row_references import recorded
from benchmarks.learning.summary import Rows, line, mean, of_policy, read_rows
from robojackson.metrics.seed_statistics import estimate

MINUTES = 5.0
POLISHED = ("g1_hip_shake", "g1_walk", "g1_authors_apt1", "g1_dance_b")
SEEDS = (100, 101, 102, 103, 104)
COMPARED = ("strict_success", "skill", "mpjpe_l_m")
BEGIN, END = "<!-- G1 polish: begin -->", "<!-- G1 polish: end -->"
COLUMNS = (
    *("move", "seeds", "steps", "strict %, mean", "worst", "skill", "mpjpe_l mm"),
    *("full time: strict %", "skill", "mm", "difference, strict points", "skill", "mm"),
    "bars missed",
)
Row = Mapping[str, Any]


def polish_rows(folders: Folders) -> list[dict[str, Any]]:
    """Return one line a move that has rows of both budgets, with their paired differences."""
    return [found for name in POLISHED if (found := _compared(name, folders)) is not None]


def _compared(name: str, folders: Folders) -> dict[str, Any] | None:
    seconds, references = HORIZONS_S[0], recorded(folders)
    files = {
        seed: [folders.row(name, seed, seconds, minutes) for minutes in (MINUTES, None)]
        for seed in SEEDS
    }
    pairs = {seed: pair for seed, pair in files.items() if all(path.is_file() for path in pair)}
    if not pairs:
        return None
    short, full = ([read_rows(pair[k]) for pair in pairs.values()] for k in (0, 1))
    poses = {references.get(path.stem) for pair in pairs.values() for path in pair}
    return {
        **line(name, MOVES[name], seconds, short),
        "cpu_minutes": MINUTES,
        "seeds": list(pairs),
        "same_reference": len(poses) == 1,
        "full_time": {key: mean(_of_seed(rows, key) for rows in full) for key in COMPARED},
        "difference": {key: _paired(short, full, key) for key in COMPARED},
    }


def _paired(short: Sequence[Rows], full: Sequence[Rows], key: str) -> list[float]:
    """Return the mean of short minus full and its 95 % interval over seeds."""
    apart = [_of_seed(a, key) - _of_seed(b, key) for a, b in zip(short, full, strict=True)]
    found = estimate(apart, np.random.default_rng(0))
    return [found.mean, found.low, found.high]


def _of_seed(rows: Rows, key: str) -> float:
    found = mean(row.get(key) for row in of_policy(rows, "trained"))
    return np.nan if found is None else found


def polish_table(rows: Iterable[Row]) -> str:
    """Return the rows as a Markdown table."""
    return markdown_table(COLUMNS, map(_cells, rows))


def _cells(row: Row) -> list[str]:
    full, apart = row["full_time"], row["difference"]
    missed = [bar for bar, held in row["bars"].items() if not held]
    note = "" if row["same_reference"] else " (another reference)"
    return [
        f"{row['move']}{note}",
        str(len(row["seeds"])),
        f"{row['steps']:,.0f}",
        f"{100 * row['strict_success']:.1f}",
        f"{100 * row['worst_seed']:.1f}",
        f"{row['skill']:.2f}",
        f"{1e3 * row['mpjpe_l_m']:.0f}",
        f"{100 * full['strict_success']:.1f}",
        f"{full['skill']:.2f}",
        f"{1e3 * full['mpjpe_l_m']:.0f}",
        _interval(apart["strict_success"], 100, 1),
        _interval(apart["skill"], 1, 2),
        _interval(apart["mpjpe_l_m"], 1e3, 0),
        ", ".join(missed) or "none",
    ]


def _interval(found: Sequence[float], scale: float, digits: int) -> str:
    middle, low, high = (f"{scale * value:+.{digits}f}" for value in found)
    return f"{middle} [{low}, {high}]"


def main() -> None:
    """Write the comparison and print it."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--folder", type=Path, help="for everything, instead of the usual places")
    folder = parser.parse_args().folder
    folders = Folders.at(folder)
    rows = polish_rows(folders)
    held = {"command": "python -m benchmarks.learning.rows.polish_rows", "rows": rows}
    folders.results.mkdir(parents=True, exist_ok=True)
    (folders.results / "learning_polish.json").write_text(json.dumps(held, indent=1) + "\n")
    table = polish_table(rows)
    if folder is None:
        replace_table(BEGIN, END, table)
    print(table)


if __name__ == "__main__":
    main()
