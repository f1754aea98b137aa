"""The figures of a study out of its tables: by (move, setup), a value for every seed."""

from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np

from configs.study_config import Study
from robojackson.files.sql_tables import RunQuery
from robojackson.metrics import learning_curve
from robojackson.rl.config.evaluate_config import HOLD, TRAINED, VARIANTS
from robojackson.rl.evaluation import verdict

INTERVALS = 40
"""Of the budget, in the learning curves."""
THRESHOLD = 0.8
"""Share of the longest mean episode of a move that counts as reached."""
LAST = 0.1
"""Share of the budget whose episodes are the end."""
EVALUATED = ("return_own", "survived_s", "stand_s", "strict_success", "skill", "limb_gain")
Key = tuple[str, str]
Seeds = Mapping[int, Mapping[str, np.ndarray]]
Figures = dict[str, dict[Key, dict[int, float]]]
Baselines = dict[str, dict[str, dict[str, float]]]


def grids_of(study: Study) -> dict[str, np.ndarray]:
    """Return, by move, the ends of the intervals of its learning curves, control steps."""
    return {move: np.linspace(0, study.steps_of(move), INTERVALS + 1) for move in study.moves}


def learning(ask: RunQuery, study: Study) -> dict[Key, dict[int, dict[str, np.ndarray]]]:
    """Return, by (move, setup) and seed, mean return and length of the episodes of each
    interval."""
    sql = (
        "SELECT move, setup, seed, step, episode_return, episode_length FROM episodes "
        "WHERE study = $study ORDER BY step"
    )
    grids = grids_of(study)
    found: dict[Key, dict[int, dict[str, np.ndarray]]] = {}
    for (move, setup, seed), rows in _grouped(ask(sql, {"study": study.name})):
        if move not in grids:
            continue
        steps = np.array([row["step"] for row in rows], float)
        found.setdefault((move, setup), {})[seed] = {
            name: learning_curve.curve(
                steps, np.array([row[name] for row in rows], float), grids[move]
            )
            for name in ("episode_return", "episode_length")
        }
    return found


def of_learning(curves: Mapping[Key, Seeds], study: Study) -> Figures:
    """Return final return, area under the curve and steps to the threshold of every seed."""
    grids = grids_of(study)
    last = max(1, round(LAST * INTERVALS))
    goal = {move: _goal(curves, move) for move in study.moves}
    return {
        "final_return": _each(curves, lambda key, seed: seed["episode_return"][-last:].mean()),
        "area": _each(curves, lambda key, seed: learning_curve.area(seed["episode_return"])),
        "steps_to": _each(
            curves,
            lambda key, seed: learning_curve.steps_to(
                grids[key[0]], seed["episode_length"], goal[key[0]]
            ),
        ),
    }


def of_evaluations(ask: RunQuery, study: Study) -> Figures:
    """Return the means over the rollouts of every trained policy."""
    sql = f"SELECT move, setup, seed, {_means(ask)} FROM evaluations WHERE study = $study "
    rows = ask(f"{sql} AND policy = 'trained' GROUP BY ALL", {"study": study.name})
    found: Figures = {name: {} for name in EVALUATED}
    for row in rows:
        for name in EVALUATED:
            if row[name] is not None:
                by_seed = found[name].setdefault((row["move"], row["setup"]), {})
                by_seed[row["seed"]] = float(row[name])
    return found


def of_baselines(ask: RunQuery, study: Study) -> Baselines:
    """Return the same figures by move and baseline policy; the feedback without the policy is
    one."""
    sql = f"SELECT move, policy, {_means(ask)} FROM evaluations WHERE study = $study "
    given = {"study": study.name, "taught": [TRAINED, HOLD]}
    rows = ask(f"{sql} AND policy NOT IN $taught GROUP BY ALL ORDER BY ALL", given)
    found: Baselines = {move: {} for move in study.moves}
    for row in rows:
        known = {name: float(row[name]) for name in EVALUATED if row[name] is not None}
        found.setdefault(row["move"], {})[row["policy"]] = known
    return found


def too_short_moves(ask: RunQuery, study: Study, baselines: Baselines) -> list[str]:
    """Return the moves whose rollouts are too short: bodies that do not dance succeed as well."""
    length = "avg(survived_s / clip_fraction) FILTER (clip_fraction > 0)"  # whoever falls early
    sql = f"SELECT move, {length} AS seconds FROM evaluations WHERE study = $study GROUP BY ALL"
    lengths = {row["move"]: row["seconds"] for row in ask(sql, {"study": study.name})}
    easy = {
        move
        for move, found in baselines.items()
        if any(
            figures.get("strict_success", 0.0) >= verdict.EASY
            for policy, figures in found.items()
            if policy not in VARIANTS
        )
    }
    short = {m for m, seconds in lengths.items() if (seconds or 0.0) < verdict.SHORTEST_S}
    return [move for move in study.moves if move in lengths and move in easy | short]


def without_unassessed(figures: Figures, unassessed: Collection[str]) -> Figures:
    """Return the figures without success and skill of moves that are too short to evaluate."""
    return {
        name: {
            k: v
            for k, v in by_key.items()
            if name not in verdict.NEEDS_FULL_LENGTH or k[0] not in unassessed
        }
        for name, by_key in figures.items()
    }


def _means(ask: RunQuery) -> str:
    """Return SQL of the means of the evaluated figures; one that no table has is null."""
    known = [row["column_name"] for row in ask("DESCRIBE evaluations")]
    gains = [name for name in known if name.startswith("limb_gain_")]
    terms = {name: f"avg({name})" for name in EVALUATED if name in known}
    # Paper mode learns from this start alone; the others are moments of the motion.
    terms["stand_s"] = "avg(survived_s) FILTER (WHERE phase < 0)"
    if gains:
        terms["limb_gain"] = f"avg(list_avg([{', '.join(gains)}]))"
    return ", ".join(f"{terms.get(name, 'NULL')} AS {name}" for name in EVALUATED)


def _grouped(rows: Sequence[Mapping[str, Any]]) -> list[tuple[tuple[str, str, int], list[Any]]]:
    found: dict[tuple[str, str, int], list[Any]] = {}
    for row in rows:
        found.setdefault((row["move"], row["setup"], row["seed"]), []).append(row)
    return list(found.items())


def _each(curves: Any, figure: Any) -> dict[Key, dict[int, float]]:
    return {
        key: {seed: float(figure(key, found)) for seed, found in seeds.items()}
        for key, seeds in curves.items()
    }


def _goal(curves: Any, move: str) -> float:
    """Return the threshold of a move: a share of the longest mean episode that any setup
    reaches."""
    means = [
        np.mean([seed["episode_length"] for seed in seeds.values()], axis=0)
        for (name, _), seeds in curves.items()
        if name == move
    ]
    return THRESHOLD * float(np.nanmax(means)) if means else np.inf
