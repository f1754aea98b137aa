"""All commands of `robojackson`: those that need Prefect or the store, and those of one stage.

Like `robojackson.cli.app`, each imports what it needs inside itself.
"""

import shlex
import sys
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from flows.cli.backup_commands import backup, restore
from flows.cli.clean_command import clean
from flows.cli.gallery_command import gallery
from flows.cli.search_commands import catalogue, find, refresh
from flows.cli.study_commands import ablation, deploy, metrics, server
from robojackson.cli.app import add_stages, make_app
from robojackson.cli.console import CommandResult, command, table
from robojackson.cli.options import (
    Config,
    End,
    Force,
    Json,
    Minutes,
    Person,
    Quality,
    Robot,
    Seed,
    Set,
    Start,
    Trainer,
    overrides_from,
    yaml_text,
)

if TYPE_CHECKING:
    from robojackson.pipeline.pipeline_config import PipelineConfig


class Shape(StrEnum):
    """How a video is laid out."""

    ROW = "row"
    SQUARE = "square"
    VERTICAL = "vertical"
    WIDE = "wide"


INSTANT_MINUTES, SEARCH_MINUTES = 1.0, 3.5
"""About what an instant dance takes until its page, for its bar: with a network, and the search of
`regulator` besides (24 to 371 CPU-seconds on quiet cores, mean of thirteen motions 201)."""
INSTANT = "--instant"
Source = Annotated[
    str | None,
    typer.Argument(
        help="A video or its address, a folder of candidates, or the name of a dance; the bundled "
        "hip_shake without one."
    ),
]
Instant = Annotated[
    bool, typer.Option(INSTANT, help="Dance at once by feedback or a tracker; no training.")
]
Robust = Annotated[
    bool, typer.Option(help="Train with varied physics, noise and pushes; with a passport.")
]
BEATS = ("beats", "precision", "recall", "f1", "bas")
"""How a dance meets its music."""
LONG_ENOUGH_S = 10.0
"""Advised rollout length where the settings' is too short to evaluate, seconds."""


@command
def dance(
    source: Source = None,
    minutes: Minutes = None,
    robot: Robot = None,
    trainer: Trainer = None,
    seed: Seed = None,
    person: Person = None,
    quality: Quality = None,
    start: Start = None,
    end: End = None,
    config: Config = "base",
    force: Force = False,
    instant: Instant = False,
    robust: Robust = False,
    music: Annotated[Path | None, typer.Option(help="A sound file instead of the clip's.")] = None,
    shape: Annotated[
        Shape | None, typer.Option("--format", help="Of the video: row, square, vertical or wide.")
    ] = None,
    set_: Set = None,
    as_json: Json = False,
) -> CommandResult:
    """Turn a video, a folder of candidates or the name of a dance into a robot that dances it."""
    from flows.runtime.environment import prepare
    from flows.search import dance_source
    from flows.search.dance_source import is_on_the_web, load_settings, resolve
    from flows.search.requests import require_findable
    from robojackson.errors import BadConfiguration
    from robojackson.pipeline.robust_training import robust_dance
    from storage.store import Store

    if instant and minutes is not None:
        raise BadConfiguration("--instant trains nothing: leave out --minutes, or --instant")
    found = None if is_on_the_web(source) else resolve(source)
    given = {
        "minutes": minutes,
        "robot": yaml_text(robot),
        "train.trainer": trainer,
        "train.seed": seed,
        "instant": instant or None,
        "render.music": yaml_text(music.resolve()) if music else None,
        "render.shape": shape and shape.value,
    }
    overrides = overrides_from(set_, given | {"dancer.number": person, "detector": quality})
    if force:
        overrides["gate"] = False
    if robust:
        overrides = robust_dance(config, overrides)
    settings = load_settings(config, overrides)
    dance_source.require_music(settings)
    if found is not None:
        dance_source.require_usable(found, settings, start, end)
    else:
        require_findable(str(source), Store.from_environment())
    prepare(Store.from_environment())
    made = _danced(found or str(source), config, overrides, start, end, settings)
    return _concluded(made, settings)


def _danced(
    source: Path | str,
    config: str,
    overrides: dict[str, Any],
    start: float | None,
    end: float | None,
    settings: "PipelineConfig",
) -> dict[str, Any]:
    """Answer a pass from its records, or run it with a bar."""
    made = None
    if isinstance(source, Path):
        from flows.video_pass.recorded_dance import replay

        made = replay(source, config, overrides, start, end)
    if made is None:
        from flows.cli.dance_bar import dance_bar, quiet_prefect
        from flows.runtime.temporary_server import temporary_server
        from storage.store import Store

        quiet_prefect()
        minutes = instant_minutes(settings) if settings.instant else settings.minutes
        with dance_bar(minutes, Store.from_environment().here), temporary_server():
            from flows.dance import run

            made = run(str(source), config, overrides, start, end)
    return made


def instant_minutes(settings: "PipelineConfig") -> float:
    """Return about how long an instant dance takes with its tracker, minutes."""
    from robojackson.pipeline.robot_descriptions import describe_robot
    from robojackson.pipeline.tracker_descriptions import require_tracker

    tracker = require_tracker(describe_robot(settings.robot).name, settings.tracker)
    searches = tracker is not None and tracker.network == "regulator"
    return INSTANT_MINUTES + (SEARCH_MINUTES if searches else 0.0)


def _concluded(made: dict[str, Any], settings: "PipelineConfig") -> CommandResult:
    """Return the answer of a dance with its verdict and the command to type next."""
    from robojackson.cli.cards import advice_lines, closing
    from robojackson.cli.stages import verdict_lines

    verdict = made["evaluation"]["verdict"]
    made |= {"verdict": verdict, "next": _next(verdict["kind"], made["page"], settings)}
    where = [f"page   {made['page']}", f"video  {made['video']}"]
    beats = table(made["beats"], BEATS) if made["beats"] else []
    text = [*verdict_lines(made["evaluation"]), *beats, *advice_lines(made), *where, *closing(made)]
    return CommandResult(made, text=text)


def _next(kind: str, page: str, settings: "PipelineConfig") -> str:
    """Return what to type after a dance."""
    if kind == "dances":
        from robojackson.cli.lifetime.interruption import python

        return shlex.join([python(), "-m", "webbrowser", page])
    if kind != "too_short" and INSTANT in sys.argv:
        from robojackson.cli.lifetime.interruption import program

        return shlex.join([program(), *(word for word in sys.argv[1:] if word != INSTANT)])
    if kind == "too_short":
        from robojackson.cli.lifetime.interruption import with_settings
        from robojackson.rl.evaluation.verdict import SHORTEST_S

        if settings.evaluate.seconds < SHORTEST_S:  # the clip may be long enough
            return with_settings({"evaluate.seconds": f"{LONG_ENOUGH_S:g}"})
        return "film or choose a range of at least two seconds (--start, --end)"
    from robojackson.cli.lifetime.interruption import with_option, with_settings
    from robojackson.rl.config.train_config import longer_budgets
    from robojackson.rl.evaluation.verdict import longer_minutes

    if longer := longer_budgets(settings.train):
        return with_settings(longer)  # the minutes of the pass do not count beside these
    return with_option("--minutes", f"{longer_minutes(settings.minutes):g}", unset=("minutes",))


app = make_app()
for each in (
    *(dance, find, refresh, catalogue, ablation, metrics),
    *(deploy, backup, restore, clean, server, gallery),
):
    app.command()(each)
add_stages(app)
