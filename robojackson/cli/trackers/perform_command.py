"""The command `perform`: several dances in a row, pushed, with a film and a page.

Like `robojackson.cli.app`, it imports what it needs inside itself.
"""

import os
from pathlib import Path
from typing import Annotated

import typer

from robojackson.cli.console import CommandResult, command, log_to_stderr
from robojackson.cli.options import Config, Folder, Json, Set, Verbose, overrides_from, yaml_text


@command
def perform(
    dances: Annotated[
        list[Path],
        typer.Argument(help="Videos, smpl.parquet or reference.parquet, in the order of dances."),
    ],
    out: Folder,
    robot: Annotated[
        str | None,
        typer.Option(
            help="Name or YAML of the robot; default: --config's, or the first tracker's."
        ),
    ] = None,
    tracker: Annotated[
        str | None,
        typer.Option(
            help="Tracker that dances (`robojackson trackers`); default: the first one here."
        ),
    ] = None,
    runs: Annotated[int, typer.Option(min=1, help="Runs; the first one is filmed.")] = 8,
    seed: Annotated[int, typer.Option(min=0, help="Of the first run's pushes.")] = 0,
    pushes: Annotated[
        float, typer.Option(min=0, max=10, help="Multiples of the passport's pushes; 0: none.")
    ] = 1.0,
    seconds: Annotated[
        float, typer.Option(min=0.1, help="How long a dance that repeats goes on, s.")
    ] = 8.0,
    film: Annotated[bool, typer.Option(help="Film the first run.")] = True,
    config: Config = "base",
    set_: Set = None,
    verbose: Verbose = False,
    as_json: Json = False,
) -> CommandResult:
    """Stand, dance one dance after the other, pushed as it goes, and stand: film, page, table."""
    from robojackson.cli import cards
    from robojackson.cli.trackers import performance_files
    from robojackson.pipeline.pipeline_config import PipelineConfig
    from robojackson.pipeline.tracker_descriptions import usual_robot
    from robojackson.pipeline.yaml_loader import load
    from robojackson.retarget.performance.programme import ProgrammeConfig
    from robojackson.rl.config.performance_config import PerformanceConfig

    os.environ.setdefault("OMP_NUM_THREADS", "1")
    log_to_stderr()
    overrides = overrides_from(set_, {"robot": yaml_text(robot), "tracker": yaml_text(tracker)})
    usual = PipelineConfig().robot  # has no tracker
    if "robot" not in overrides and load(PipelineConfig, config, overrides).robot == usual:
        overrides["robot"] = yaml_text(usual_robot())
    answer = performance_files.perform(
        dances, out,
        PerformanceConfig(runs=runs, seed=seed, pushes=pushes), ProgrammeConfig(dance_s=seconds),
        config, overrides, film,
    )  # fmt: skip
    text = cards.shown(answer, performance_files.card(answer), verbose)
    return CommandResult(answer, text=text)
