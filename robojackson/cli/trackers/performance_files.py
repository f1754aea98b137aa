"""A performance from files to files: tables, film and page."""

import logging
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from robojackson.api import performances
from robojackson.api.evaluation import render_video
from robojackson.api.performances import Performance
from robojackson.cli import cards, console
from robojackson.errors import MissingDependency
from robojackson.pipeline.pipeline_config import PipelineConfig
from robojackson.pipeline.yaml_loader import load
from robojackson.report.pages.performance_page import performance_page
from robojackson.retarget.performance.programme import ProgrammeConfig
from robojackson.rl.config.performance_config import PerformanceConfig
from robojackson.rl.evaluation.performance_record import PartRow, RunRow, Summary

FILM, PAGE = "performance.mp4", "index.html"
COLUMNS = ("seconds", "began", "whole", "mpjpe_l_m")
ALL_UP, SOME_FELL = "performs", "falls"

log = logging.getLogger(__name__)


class Answer(Summary):
    """What the command answers."""

    parts: list[PartRow]
    rows: list[RunRow]
    page: str
    film: str | None
    verdict: dict[str, str]


def perform(
    dances: Sequence[Path],
    out: Path,
    how: PerformanceConfig,
    programme: ProgrammeConfig,
    config: str,
    overrides: Mapping[str, object],
    film: bool,
) -> Answer:
    """Perform, and write programme, first run, rows, film and page into a folder.

    Raises:
        What `robojackson.api.performances.perform` raises.
    """
    settings = load(PipelineConfig, config, overrides)
    done = performances.perform(
        list(dances), settings.robot, tracker=settings.tracker, config=how, programme=programme,
        retarget=settings.retarget, progress=True,
    )  # fmt: skip
    done.save(out)
    shown = FILM if film and _filmed(done, out / FILM, settings) else None
    title = " · ".join(part.name for part in done.programme.parts if part.is_dance)
    performance_page(out / PAGE, title, done.summary, done.parts, done.runs, shown)
    return Answer(
        **done.summary, parts=done.parts, rows=done.runs, page=str(out / PAGE),
        film=str(out / shown) if shown else None, verdict=_verdict(done.summary),
    )  # fmt: skip


def card(answer: Answer) -> list[str]:
    """Return the parts of a performance and the verdict for people."""
    rows: dict[str, Mapping[str, object]] = {
        f"{i + 1} {row['part']}": dict(row) for i, row in enumerate(answer["parts"])
    }
    places = [f"page      {answer['page']}"]
    if answer["film"]:
        places.append(f"film      {answer['film']}")
    return [*console.table(rows, COLUMNS), *places, *cards.closing(dict(answer))]


def _filmed(done: Performance, out: Path, settings: PipelineConfig) -> bool:
    """Film the first run; return whether that could be done."""
    seconds = len(done.rollout.qpos) * done.rollout.dt
    video = replace(settings.render, max_seconds=seconds)
    try:
        render_video(
            out, done.followed, rollout=done.rollout, robot=settings.robot, config=video,
            title=f"tracker {done.summary['tracker']}", progress=True,
        )  # fmt: skip
    except MissingDependency as cause:
        log.warning("no film: %s", cause)
        return False
    return True


def _verdict(summary: Summary) -> dict[str, str]:
    finished, runs = summary["finished"], summary["runs"]
    pushed = "pushed" if summary["pushes"] else "without pushes"
    sentence = (
        f"{summary['tracker']} stands at the end of {finished} of {runs} runs, {pushed}; "
        f"{summary['uninterrupted']} gave no part up; "
        f"{100 * summary['danced_share']:.0f} % of the dances were danced."
    )
    return {"kind": ALL_UP if finished == runs else SOME_FELL, "sentence": sentence}
