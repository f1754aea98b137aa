"""Trained policies as one table: means over seeds, every bar, and those that do not dance."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.learning.policies import TRAINED, Folders, Move, forced
from benchmarks.learning.rows.row_bars import LIMBS, bars
from benchmarks.learning.rows.row_references import standing
from robojackson.files import tables
from robojackson.metrics.seed_statistics import estimate
from robojackson.pipeline.table_schemas import EVALUATION_RECORD

Rows = list[dict[str, Any]]
AUTHORS_ROBOT = {
    "survived_s": 1.63,
    "note": "at best: 27 steps of 0.06 s in the authors' own logs; nothing else is known of it",
}
BESIDE = ("statue", "mean_pose", "zero_residual", "random", "hold")
COLUMNS = (
    "survived_s", "strict_success", "skill", "velocity_score", "mpjpe_l_m", "mpjpe_g_m",
    "acceleration_ratio",
)  # fmt: skip
FURTHER = ("success", "mpjpe_l_alive_m", "mpjpe_g_alive_m")
"""Figures of the policy alone: without a fall, and the distances until one."""


def summary(folders: Folders) -> Rows:
    """Return one line a move and a horizon, over the seeds that exist."""
    lines = []
    for name, move in TRAINED.items():
        for seconds in move.horizons_s:
            found = sorted(folders.rows.glob(folders.row(name, "[0-9]*", seconds).name))
            exact = [path for path in found if path == folders.row(name, _seed(path), seconds)]
            if exact:
                seeds = [read_rows(path) for path in exact]
                lines.append(
                    line(name, move, seconds, seeds)
                    | {"forced": forced(name, folders), **standing(name, exact, folders)}
                )
    return lines


def line(name: str, move: Move, seconds: float, seeds: Sequence[Rows]) -> dict[str, Any]:
    """Return the figures of a move and whether each of its bars holds."""
    trained = [of_policy(rows, "trained") for rows in seeds]
    all_keys = (*COLUMNS, *FURTHER)
    by_seed = {key: [mean(r.get(key) for r in rows) for rows in trained] for key in all_keys}
    success = [value or 0.0 for value in by_seed["strict_success"]]
    taken = [row.get("step") for rows in trained for row in rows]
    found: dict[str, Any] = {
        "move": name,
        "cpu_minutes": move.cpu_minutes,
        "horizon_s": seconds if move.cyclic else None,
        "seeds": len(seeds),
        "steps": mean(taken) if None not in taken else None,
        **{key: mean(values) for key, values in by_seed.items()},
        "mpjpe_rollouts": counted_rollouts([row for rows in trained for row in rows]),
        "strict_success_95": list(cluster_interval(success)),
        "worst_seed": min(success),
        "whole_phases": mean(whole_phases(rows) for rows in trained),
    }
    for kind in ("limb_gain", "limb_r2", "excess_speed"):
        found[kind] = {
            limb: mean(mean(r.get(f"{kind}_{limb}") for r in rows) for rows in trained)
            for limb in LIMBS
        }
    found["bars"] = bars(found, name, move)
    found["holds"] = all(found["bars"].values())
    found["beside"] = {
        policy: _baseline([r for rows in seeds for r in of_policy(rows, policy)])
        for policy in BESIDE
    }
    return found


def _baseline(rows: Rows) -> dict[str, Any]:
    """Return the means of a baseline's rollouts."""
    figures = {key: mean(row.get(key) for row in rows) for key in COLUMNS}
    return figures | {"mpjpe_rollouts": counted_rollouts(rows)}


def counted_rollouts(rows: Rows) -> str | None:
    """Return over how many rollouts `mpjpe_l_m` and `mpjpe_g_m` are means; None where over none.

    The rollouts of Humanoid-v5 and of baselines end with a fall, and only those without one count;
    other robots that fell are simulated and counted to the horizon.
    """
    values = (row.get("mpjpe_l_m") for row in rows)
    counted = sum(value is not None and bool(np.isfinite(value)) for value in values)
    if not counted:
        return None
    if counted == len(rows):
        return f"all {counted} rollouts"
    return f"{counted} of {len(rows)} rollouts, fallen robots left out"


def whole_phases(rows: Rows) -> float:
    """Return the share of starts (phases and the stand) whose resets all succeed strictly."""
    lost = {row.get("phase") for row in rows if not row["strict_success"]}
    return 1.0 - len(lost) / len({row.get("phase") for row in rows})


def cluster_interval(by_seed: Sequence[float] | np.ndarray) -> tuple[float, float]:
    """Return 95 % interval of the mean by resampling seeds; rollouts of one seed are no
    evidence."""
    found = estimate(list(by_seed), np.random.default_rng(0))
    return (found.low, found.high) if found.count > 1 else (found.mean, found.mean)


def of_policy(rows: Rows, policy: str) -> Rows:
    """Return the rollouts of one driver."""
    return [row for row in rows if row["policy"] == policy]


def mean(values: Any) -> float | None:
    """Return the mean of the values that are numbers; None where there is none."""
    finite = [float(value) for value in values if value is not None and np.isfinite(value)]
    return float(np.mean(finite)) if finite else None


def read_rows(path: Path) -> Rows:
    """Return the rollouts of a kept row."""
    return tables.decode_rows(EVALUATION_RECORD, path.read_bytes(), str(path))


def _seed(path: Path) -> str:
    return path.stem.rsplit("-s", 1)[1].split("-")[0]
