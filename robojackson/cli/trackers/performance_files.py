"""A performance from files to files: tables, film and page."""

import logging
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from robojackson.cli import console
from robojackson.errors import MissingDependency
from robojackson.files.json_types import to_json_types
from robojackson.pipeline.yaml_loader import load

if TYPE_CHECKING:
    from robojackson.api.performances import Performance
    from robojackson.retarget.performance.programme import ProgrammeConfig
    from robojackson.rl.evaluation.performance import PerformanceConfig

FILM, PAGE = "performance.mp4", "index.html"
COLUMNS = ("seconds", "began", "whole", "mpjpe_l_m")
ALL_UP, SOME_FELL = "performs", "falls"

log = logging.getLogger(__name__)


def perform(
    dances: Sequence[Path],
    out: Path,
    robot: str,
    tracker: str | None,
    how: "PerformanceConfig",
    programme: "ProgrammeConfig",
    config: str,
    overrides: Mapping[str, object],
    film: bool,
) -> dict[str, Any]:
    """Perform, and write programme, first run, rows, film and page into a folder.

    Raises:
        What `robojackson.api.performances.perform` raises.
    """
    from robojackson.api import performances
    from robojackson.api.evaluation import render_video
    from robojackson.pipeline.pipeline_config import PipelineConfig
    from robojackson.report.pages.performance_page import performance_page

    settings = load(PipelineConfig, config, overrides)
    done = performances.perform(
        list(dances), robot, tracker=tracker, config=how, programme=programme,
        retarget=settings.retarget, progress=True,
    )  # fmt: skip
    done.save(out)
    shown = None
    if film:
        seconds = len(done.rollout.qpos) * done.rollout.dt
        video = replace(settings.render, max_seconds=seconds)
        try:
            render_video(
                out / FILM, done.followed, rollout=done.rollout, robot=robot, config=video,
                title=f"tracker {done.summary['tracker']}", progress=True,
            )  # fmt: skip
            shown = FILM
        except MissingDependency as cause:
            log.warning("no film: %s", cause)
    title = " · ".join(part.name for part in done.programme.parts if part.is_dance)
    performance_page(out / PAGE, title, done.summary, done.parts, done.runs, shown)
    answer = {**done.summary, "parts": done.parts, "rows": done.runs, "page": str(out / PAGE)}
    answer |= {"film": str(out / shown) if shown else None, "verdict": _verdict(done)}
    return dict(to_json_types(answer))


def table(answer: Mapping[str, Any]) -> list[str]:
    """Return the parts of a performance for people."""
    rows = {f"{i + 1} {row['part']}": row for i, row in enumerate(answer["parts"])}
    places = [f"{name:<9} {answer[name]}" for name in ("page", "film") if answer[name]]
    return [*console.table(rows, COLUMNS), *places]


def _verdict(done: "Performance") -> dict[str, str]:
    summary = done.summary
    finished, runs, whole = (summary[name] for name in ("finished", "runs", "uninterrupted"))
    pushed = "pushed" if summary["pushes"] else "without pushes"
    sentence = (
        f"{summary['tracker']} stands at the end of {finished} of {runs} runs, {pushed}; "
        f"{whole} gave no part up; {100 * summary['danced_share']:.0f} % of the dances were danced."
    )
    return {"kind": ALL_UP if finished == runs else SOME_FELL, "sentence": sentence}
