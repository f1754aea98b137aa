"""Table II of a study in numbers: a line a setup and move, then one a policy without learning."""

import csv
import io
from collections.abc import Mapping, Sequence

import numpy as np

from robojackson.metrics.seed_statistics import Estimate, estimate
from robojackson.report.pages.study_page import FIGURES, Line

BySeed = Mapping[tuple[str, str], Mapping[int, float]]
"""The value of each seed, by (move, setup)."""


def table(
    figures: Mapping[str, BySeed],
    baselines: Mapping[str, Mapping[str, Mapping[str, float]]],
    moves: Sequence[str],
    setups: Sequence[str],
    rng: np.random.Generator,
) -> list[Line]:
    """Return the lines of the table.

    Args:
        figures: Values of the seeds, by name of the figure.
        baselines: Values by move, policy and name of the figure.
        moves, setups: Names in the order of the lines.
        rng: Random numbers of the bootstrap.
    """
    lines = []
    for move in moves:
        for setup in setups:
            seeds = {name: by_key.get((move, setup), {}) for name, by_key in figures.items()}
            values = {
                name: estimate(list(by_seed.values()), rng) for name, by_seed in seeds.items()
            }
            count = max((len(by_seed) for by_seed in seeds.values()), default=0)
            lines.append(Line(move, setup, count, values))
        for policy, known in baselines.get(move, {}).items():
            values = {n: Estimate(v, np.nan, np.nan, 1) for n, v in known.items()}
            lines.append(Line(move, policy, 0, values, baseline=True))
    return lines


def to_csv(lines: Sequence[Line]) -> bytes:
    """Return the table as CSV: mean, low and high of every figure; empty where there is none."""
    out = io.StringIO()
    rows = csv.writer(out)
    parts = [f"{name}{part}" for name in FIGURES for part in ("", "_low", "_high")]
    rows.writerow(["move", "setup", "seeds", *parts])
    for line in lines:
        found = [line.values.get(name) for name in FIGURES]
        flat = [v for e in found for v in ((e.mean, e.low, e.high) if e else (np.nan,) * 3)]
        cells = ["" if np.isnan(value) else value for value in flat]
        rows.writerow([line.move, line.setup, line.seeds, *cells])
    return out.getvalue().encode()
