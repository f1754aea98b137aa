"""Races between trainings on the hip-shake, in CPU seconds of one core.

`survival`: ours beside sb3-contrib's defaults on the same environment, up to a mean survival of
5 s; the peer is stopped at ten times ours, which is then a lower bound. `pretraining`: the setups
scratch and pretrain, paired by seed, area under the survival curve. Every curve is a cached file.
"""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.learning.policies import Folders, reference_of
from benchmarks.learning.speed import comparison
from benchmarks.learning.summary import cluster_interval
from benchmarks.learning.training_curve import STOCK, area, curve_of, first_at

GOAL_S, FACTOR = 5.0, 10.0
LAST_SHARE = 0.1
"""Of a curve, over which its final survival is taken."""
Points = list[tuple[float, int, float]]


def survival(folders: Folders, minutes: float, seed: int = 0) -> dict[str, Any]:
    """Return CPU seconds to a mean survival of 5 s, ours over the peer's."""
    reference, work = reference_of("hip_shake", folders), folders.work / "survival"
    ours = curve_of(reference, work / f"ours-s{seed}.json", [f"seed={seed}"], GOAL_S, minutes)
    spent = ours["points"][-1][0]
    limit = FACTOR * spent / 60
    name = f"sb3-s{seed}-{limit:.2f}.json"
    peer = curve_of(reference, work / name, [f"seed={seed}", *STOCK], GOAL_S, limit)
    theirs = peer["points"][-1][0] if peer["reached"] else 60 * limit
    what = "CPU s to a mean survival of 5 s on hip_shake, ours over sb3-contrib's default"
    row = comparison(what, spent, theirs, spent / theirs, "<= 0.1")
    best = [max(survived for _, _, survived in curve["points"]) for curve in (ours, peer)]
    return {
        **row,
        "holds": bool(ours["reached"] and (row["holds"] or not peer["reached"])),
        "ours_reached": ours["reached"],
        "peer_is_lower_bound": not peer["reached"],
        "best_survival_s": {"ours": best[0], "peer": best[1]},
        "seed": seed,
    }


def pretraining(
    folders: Folders, seeds: Sequence[int], minutes: float, cost_s: float | None
) -> dict[str, Any]:
    """Return scratch against pretrain, paired by seed, at equal CPU minutes.

    Args:
        cost_s: CPU seconds that the walker took; from a `walker.json` beside it or by hand.
    """
    reference, work = reference_of("hip_shake", folders), folders.work / "pretraining"
    pairs = []
    for seed in seeds:
        pair = {}
        for setup, start in (("scratch", "scratch"), ("pretrain", "walker")):
            options = [f"seed={seed}", f"start={start}"]
            out = work / f"{setup}-s{seed}-{minutes:g}min.json"
            curve = curve_of(reference, out, options, float("inf"), minutes)
            pair[setup] = [(float(t), int(n), float(s)) for t, n, s in curve["points"]]
        pairs.append({"seed": seed, **compared(pair["scratch"], pair["pretrain"], 60 * minutes)})
    keep(folders.results / "learning_pretraining.json", pairs)
    return concluded(pairs, minutes, cost_s)


def compared(scratch: Points, pretrain: Points, seconds: float) -> dict[str, Any]:
    """Return one seed: mean survival under both curves, s, and CPU seconds that the walker saves.

    Saved is what lies between the end and the moment at which the pretrained run survives as long
    as the other one does in the end; it is nothing when that never comes.
    """
    tail = [s for t, _, s in scratch if t >= (1 - LAST_SHARE) * seconds] or [scratch[-1][2]]
    level = float(np.mean(tail))
    moments = [first_at(points, level) for points in (scratch, pretrain)]
    alone, after = (seconds if moment is None else moment for moment in moments)
    return {
        "scratch_s": area(scratch, seconds),
        "pretrain_s": area(pretrain, seconds),
        "level_s": level,
        "saved_cpu_s": alone - after,
    }


def concluded(pairs: list[dict[str, Any]], minutes: float, cost_s: float | None) -> dict[str, Any]:
    """Return the means over seeds with 95 % intervals, and after how many dances the walker has
    paid."""
    gain = np.array([pair["pretrain_s"] - pair["scratch_s"] for pair in pairs])
    saved = np.array([pair["saved_cpu_s"] for pair in pairs])
    per_dance = float(saved.mean())
    pays = cost_s / per_dance if cost_s is not None and per_dance > 0 else None
    return {
        "what": "survival under the curve, pretrain minus scratch, s",
        "ours": float(np.mean([pair["pretrain_s"] for pair in pairs])),
        "peer": float(np.mean([pair["scratch_s"] for pair in pairs])),
        "gain_s": float(gain.mean()),
        "gain_95": list(cluster_interval(gain)),
        "saved_cpu_s": per_dance,
        "saved_95": list(cluster_interval(saved)),
        "pretraining_cpu_s": cost_s,
        "pays_after_dances": pays,
        "seeds": len(pairs),
        "cpu_minutes": minutes,
    }


def keep(path: Path, rows: list[dict[str, Any]]) -> None:
    """Write rows as JSON."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(rows, indent=1) + "\n")
