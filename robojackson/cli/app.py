"""Commands that run one stage, as one application; `flows.cli.commands` adds the others.

Commands import what they need in their bodies: a stage runs without Prefect, `--help` is fast.
"""

import os
import platform
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Literal

import typer

from robojackson.cli.console import (
    USAGE_ERROR,
    CommandResult,
    command,
    complain,
    log_to_stderr,
    usage_error,
)
from robojackson.cli.format_commands import ExportCommand, export, import_
from robojackson.cli.learning_commands import evaluate, pretrain, train
from robojackson.cli.options import (
    Config,
    End,
    Folder,
    Force,
    Json,
    Person,
    Quality,
    Robot,
    SecondVideo,
    SetMocap,
    SetRetarget,
    Start,
    Verbose,
    Weights,
    overrides_from,
    yaml_text,
)
from robojackson.cli.pictures.view_command import view
from robojackson.cli.robot_commands import robots
from robojackson.cli.trackers.perform_command import perform
from robojackson.cli.trackers.tracker_commands import trackers


@command
def score(
    video: Annotated[list[Path], typer.Argument(help="Videos, or folders of them.")],
    person: Person = None,
    config: Config = "base",
    set_: SetMocap = None,
    verbose: Verbose = False,
    as_json: Json = False,
) -> CommandResult:
    """Score how steadily the dancer is tracked (Algorithm 1; lowest is best).

    Exit code 1 where a video given by name cannot be read; one inside a folder is only reported.
    """
    from robojackson.cli import cards, scoring

    log_to_stderr()
    scored = scoring.score(video, config, overrides_from(set_, {"dancer.number": person}))
    unread = {entry["video"] for entry in scored["videos"] if "error" in entry}
    text = cards.shown(scored, cards.score_lines(scored), verbose)
    return CommandResult(scored, code=1 if unread & set(map(str, video)) else 0, text=text)


@command
def mocap(
    video: Annotated[Path, typer.Argument(help="A video of one person.")],
    out: Folder,
    second: SecondVideo = None,
    hybrik: Weights = None,
    niki: Weights = None,
    person: Person = None,
    quality: Quality = None,
    start: Start = None,
    end: End = None,
    people: Annotated[
        bool, typer.Option("--people", help="Only list the people, with a picture.")
    ] = False,
    hypotheses: Annotated[
        int, typer.Option(min=0, max=100, help="Also sample poses of hidden limbs: smpl_1...")
    ] = 0,
    film: Annotated[
        bool, typer.Option("--video", help="Also render a video: source, skeleton, body.")
    ] = False,
    config: Config = "base",
    set_: SetMocap = None,
    verbose: Verbose = False,
    as_json: Json = False,
) -> CommandResult:
    """Recover the motion of the person in a video: smpl.parquet, landmarks, a picture."""
    from robojackson.cli import cards, mocap_card, stages, video_range
    from robojackson.cli.pictures.mocap_pictures import draw_mocap
    from robojackson.cli.pictures.people_listing import list_people

    log_to_stderr()
    brought = {"network.hybrik": yaml_text(hybrik), "network.niki": yaml_text(niki)}
    overrides = overrides_from(set_, {**brought, "dancer.number": person, "detector": quality})
    if people:
        others = {"a second clip": second, "--hypotheses": hypotheses, "--video": film}
        data, lines = list_people(video, out, (start, end), config, overrides, others)
        return CommandResult(data, text=lines)
    with video_range.video_range(video, second, out, (start, end), config, overrides) as clip:
        made = stages.mocap(clip, out, config, overrides, hypotheses, second, start, video)
        made = mocap_card.with_verdict(made | draw_mocap(clip, out, config, overrides, film, start))
    return CommandResult(made, text=cards.shown(made, mocap_card.mocap_lines(made), verbose))


@command
def retarget(
    smpl: Annotated[Path, typer.Argument(help="smpl.parquet of `robojackson mocap`.")],
    out: Folder,
    robot: Robot = None,
    method: Annotated[
        Literal["optimise", "paper", "framefix"] | None,
        typer.Option(help="Ours, the paper's Table I, or the table with corrected axes."),
    ] = None,
    video: Annotated[
        bool, typer.Option("--video", help="Also render a video and plot contacts and torques.")
    ] = False,
    config: Config = "base",
    force: Force = False,
    set_: SetRetarget = None,
    verbose: Verbose = False,
    as_json: Json = False,
) -> CommandResult:
    """Retarget a motion to a robot: reference.parquet, scorecard.json and a picture."""
    from robojackson.cli import cards, stages
    from robojackson.cli.pictures.retarget_pictures import draw_poses, draw_retargeting

    os.environ.setdefault("OMP_NUM_THREADS", "1")
    log_to_stderr()
    overrides = overrides_from(set_, {"retarget.method": method, "robot": yaml_text(robot)})
    made = stages.retarget(smpl, out, config, overrides)
    made |= draw_poses(smpl, out)
    if video:
        made |= draw_retargeting(smpl, out, config, overrides)
    if not force:
        stages.gate(made["scorecard"], out, config, overrides)
    return CommandResult(made, text=cards.shown(made, cards.retarget_lines(made), verbose))


@command
def doctor(
    report: Annotated[
        bool, typer.Option("--report", help="Print Markdown to paste into an issue.")
    ] = False,
    as_json: Json = False,
) -> CommandResult:
    """Show what is installed, what is missing, and how to get it."""
    from robojackson.cli.diagnosis.doctor import doctor_lines, examine

    found = examine()
    if report:
        from robojackson.cli.diagnosis.issue_report import issue_report

        block = issue_report(found)
        return CommandResult({"report": "\n".join(block)}, text=block)
    return CommandResult(found, code=0 if found["ok"] else 1, text=doctor_lines(found))


@command
def licences(
    sbom: Annotated[
        Path | None, typer.Option("--sbom", help="Also write a bill of materials (CycloneDX JSON).")
    ] = None,
    as_json: Json = False,
) -> CommandResult:
    """List the licences of all packages in use, and of the data that ships."""
    from robojackson.pipeline import licences as listing

    rows, data = listing.packages(), listing.data()
    if sbom is not None:
        listing.write_sbom(sbom, rows)
    wide = max(len(row["package"]) + len(row["version"]) for row in rows) + 3
    text = [f"{row['package'] + ' ' + row['version']:<{wide}}{row['licence']}" for row in rows]
    text += ["", *(f"{row['data']}: {row['licence']} ({row['what']})" for row in data)]
    return CommandResult({"packages": rows, "data": data}, text=text)


STAGES: dict[str, Callable[..., None]] = {
    "score": score,
    "mocap": mocap,
    "retarget": retarget,
    "import": import_,
    "export": export,
    "train": train,
    "pretrain": pretrain,
    "evaluate": evaluate,
    "perform": perform,
    "view": view,
    "doctor": doctor,
    "licences": licences,
}
"""Commands by name, in the order of `--help`."""


def _print_version(given: bool) -> None:
    """Print the versions of the package and of Python, and end the command."""
    if given:
        from importlib.metadata import version

        typer.echo(f"robojackson {version('robojackson')}, Python {platform.python_version()}")
        raise typer.Exit


def make_app() -> typer.Typer:
    """Return an application without commands, with `--version` and shell completion."""
    app = typer.Typer(
        name="robojackson",
        help="Turn a video of a person dancing into a robot that dances it.",
        no_args_is_help=True,
        pretty_exceptions_enable=False,
        context_settings={"help_option_names": ["-h", "--help"]},
    )
    app.callback()(_common)
    return app


def _common(
    version: Annotated[
        bool,
        typer.Option("--version", callback=_print_version, is_eager=True, help="Show the version."),
    ] = False,
) -> None:
    """Handle the options of the application itself; each ends the process."""


def add_stages(app: typer.Typer) -> None:
    """Add the commands of this module, and the groups `robots` and `trackers`."""
    app.add_typer(robots, name="robots")
    app.add_typer(trackers, name="trackers")
    for name, stage in STAGES.items():
        app.command(name, cls=ExportCommand if stage is export else None)(stage)


def run(app: typer.Typer) -> int:
    """Run the command in the arguments of the process; return its exit code."""
    try:
        return app(standalone_mode=False) or 0
    except USAGE_ERROR as cause:
        if type(cause).__name__ == "NoArgsIsHelpError":
            cause.show()
        else:
            complain(usage_error(cause))
        return 2
