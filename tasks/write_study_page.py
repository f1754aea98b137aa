"""The results of a study out of its tables: numbers, figures, and a page that explains them.

Drawing takes seconds, so it is done again only when the rows, or the code that reads them, are
others.
"""

import json
import warnings
from collections.abc import Collection, Mapping, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from configs.study_config import Move, Study
from robojackson.errors import RoboJacksonError
from robojackson.files.json_types import to_json
from robojackson.files.sql_tables import RunQuery
from robojackson.metrics import ablation_statistics
from robojackson.pipeline.robot_descriptions import describe_robot
from robojackson.report.pages import study_page, study_table
from robojackson.report.pages.run_page import Plot
from robojackson.report.pages.study_figures import SeedCurves, curve_plots, evaluation_plots
from robojackson.report.web.shown_run import small_picture
from robojackson.rl.evaluation.verdict import NEEDS_FULL_LENGTH
from robojackson.rl.pretrained import pretrained
from storage import study_tables
from storage.artifact import Artifact
from storage.store import Store
from tasks.runtime.code_digest import digest, template_digests
from tasks.runtime.stage import stage
from tasks.study_results import (
    EVALUATED,
    grids_of,
    learning,
    of_baselines,
    of_evaluations,
    of_learning,
    too_short_moves,
    without_unassessed,
)

FOLDER = "studies"
TEMPLATES = ("study.html", "page.css", "figures.html")
LEAST_STEPS = 10_000
"""Control steps of a training below which nothing is learnt."""
PRIMARY = "return_own"
"""The figure that the claims are about, chosen before any run (docs/ablation.md)."""


def _models(parameters: Mapping[str, Any]) -> list[str]:
    return [*template_digests(__name__, TEMPLATES), digest(("storage.study_tables",), "storage")]


@stage(models=_models)
def write_study_page(
    study: Study,
    moves: dict[str, Move],
    rows: list[Artifact],
    pictures: dict[str, Artifact],
    reward_audits: dict[str, Artifact],
) -> dict[str, Artifact]:
    """Write the files of `report`.

    Args:
        rows: Files of the tables of the cells that count (`storage.study_tables.files_of`).
        pictures, reward_audits: By move, as in `report`; the second as JSON.
    """
    store = Store.from_environment()
    shown = {name: store.read(png.key) for name, png in pictures.items()}
    paid = {name: json.loads(store.read(text.key)) for name, text in reward_audits.items()}
    return report(study, moves, shown, study_tables.runs_of(rows), paid)


def report(
    study: Study,
    moves: Mapping[str, Move],
    pictures: Mapping[str, bytes] | None = None,
    runs: Collection[str] | None = None,
    reward_audits: Mapping[str, study_page.RewardAudits] | None = None,
) -> dict[str, Artifact]:
    """Write `studies/<name>/` again: `page`, `table` (CSV), `results` (JSON) and the figures.

    Args:
        moves: Moves of the study, by name.
        pictures: Picture of each move as PNG: video frame, recovered body and robot side by side.
        runs: Ids of the trainings that count; all that the tables have under its name if absent.
        reward_audits: What the rewards of the setups pay to bodies that do not dance, by move.
    """
    store, rng = Store.from_environment(), np.random.default_rng(0)
    with study_tables.opened(store, study.name, runs) as ask:
        curves = learning(ask, study)
        figures = {**of_learning(curves, study), **of_evaluations(ask, study)}
        baselines, facts = of_baselines(ask, study), _facts(ask, study)
        short = too_short_moves(ask, study, baselines)
        notes = [*_meaningless(study), *_too_short(short), *_few(study), *_starts(ask, study)]
    figures = without_unassessed(figures, short)
    for move in short:
        baselines[move] = {
            policy: {name: value for name, value in found.items() if name not in NEEDS_FULL_LENGTH}
            for policy, found in baselines[move].items()
        }
    walking = {name: move.walking for name, move in moves.items()}
    claims = ablation_statistics.claims(figures[PRIMARY], walking, rng)
    compared = ablation_statistics.comparisons(figures[PRIMARY], study.moves, rng)
    lines = study_table.table(figures, baselines, study.moves, study.setups, rng)
    evaluated = {name: figures[name] for name in EVALUATED}
    content = study_page.StudyContent(
        title=study.name,
        facts=facts,
        claims=claims,
        lines=lines,
        comparisons=compared,
        reward_audits=reward_audits or {},
        moves=[_picture(name, moves[name], png) for name, png in (pictures or {}).items()],
        thumbnails={name: small_picture(png) for name, png in (pictures or {}).items()},
        learning=_learning(curves),
        curves=curve_plots(curves, grids_of(study), study.moves, study.setups),
        evaluation_plots=evaluation_plots(evaluated, baselines, study.moves, study.setups),
        notes=notes,
    )
    folder = f"{FOLDER}/{study.name}"
    made = {
        "page": store.put(f"{folder}/index.html", study_page.render(content).encode()),
        "table": store.put(f"{folder}/table.csv", study_table.to_csv(lines)),
        "results": store.put(f"{folder}/results.json", _json(claims, compared, lines)),
    }
    for plot in (*content.curves, *content.evaluation_plots, *content.moves):
        made[plot.title] = store.put(f"{folder}/{_file(plot.title)}.png", plot.png)
    return made


def _facts(ask: RunQuery, study: Study) -> dict[str, Any]:
    sql = "SELECT DISTINCT git_commit FROM runs WHERE study = $study"
    commits = [row["git_commit"] or "?" for row in ask(sql, {"study": study.name})]
    return {
        "robot": describe_robot(study.robot).name,
        "mode": study.mode,
        "trainer": study.trainer,
        "steps": study.steps_label,
        "seeds": ", ".join(map(str, study.seeds)),
        "code": ", ".join(sorted(commit[:10] for commit in commits)),
    }


def _meaningless(study: Study) -> list[str]:
    if min(map(study.steps_of, study.moves)) >= LEAST_STEPS:
        return []
    return [
        f"Trainings of {study.steps_label} control steps: this study shows that every part runs; "
        "its numbers mean nothing."
    ]


def _too_short(moves: Sequence[str]) -> list[str]:
    if not moves:
        return []
    return [
        f"{', '.join(moves)}: too short to evaluate. Bodies that do not dance succeed as well, so "
        "success and skill are left out."
    ]


def _few(study: Study) -> list[str]:
    pairs = len(study.seeds)
    if pairs >= 6:
        return []
    least = 2.0 ** (1 - pairs)
    return [
        f"{pairs} seed{'s' if pairs != 1 else ''}: no difference can have a p below {least:.2g}, "
        "so nothing here is a statement; ten seeds are."
    ]


def _starts(ask: RunQuery, study: Study) -> list[str]:
    """Return what was learnt before the first step of a cell: it belongs to the price of
    pretraining."""
    sql = "SELECT DISTINCT setup, config FROM runs WHERE config IS NOT NULL ORDER BY ALL"
    setups: dict[str, set[str]] = {}
    for row in ask(sql):
        setups.setdefault(json.loads(row["config"])["start"], set()).add(row["setup"])
    setups.pop("scratch", None)
    return [
        f"{', '.join(sorted(names))} begin{'' if len(names) > 1 else 's'} with networks ({start}) "
        f"that had learnt for {_steps_of(start, study)} control steps before; curves and steps "
        "here do not count them."
        for start, names in setups.items()
    ]


def _steps_of(start: str, study: Study) -> str:
    try:
        networks = pretrained(start, study.mode, describe_robot(study.robot))
    except RoboJacksonError:
        networks = None
    steps = networks.facts.get("steps") if networks else None
    return f"{steps:,}" if isinstance(steps, int) else "an unknown number of"


def _learning(curves: SeedCurves) -> dict[tuple[str, str], list[float]]:
    """Return the mean return of each interval over the seeds; NaN where no episode ended."""
    found = {}
    for key, seeds in curves.items():
        returns = np.array([seed["episode_return"] for seed in seeds.values()], float)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", RuntimeWarning)  # an interval without any episode
            found[key] = np.nanmean(returns, 0).tolist()
    return found


def _picture(name: str, move: Move, png: bytes) -> Plot:
    stands = f" (for the paper's {move.paper})" if move.paper else ""
    text = "The video, the body recovered from it, and the same moment on the robot."
    return Plot(f"{name}{stands}", text, png)


def _json(
    claims: Sequence[ablation_statistics.Claim],
    compared: Sequence[ablation_statistics.Comparison],
    lines: Sequence[study_page.Line],
) -> bytes:
    text = {
        "primary": PRIMARY,
        "claims": [{**asdict(claim), "sentence": study_page.sentence(claim)} for claim in claims],
        "comparisons": [asdict(comparison) for comparison in compared],
        "lines": [asdict(line) for line in lines],
    }
    return to_json(text)


def _file(title: str) -> str:
    return "".join(c if c.isalnum() else "-" for c in title.lower()).strip("-")
