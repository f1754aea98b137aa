"""The `robojackson` command.

Every command imports what it needs inside itself, so that the one-stage commands run with no
Prefect in memory and `--help` answers at once.
"""

if __name__ == "__main__":  # Ctrl-C while the lines below are imported is told in one line, too
    from robojackson.cli.start import main as start

    start()

import os
from pathlib import Path
from typing import Annotated, Literal

import typer

from flows.cli.backup_commands import backup, restore
from flows.cli.search_commands import catalogue, find, refresh
from flows.cli.study_commands import ablation, deploy, metrics, server
from robojackson.cli.console import USAGE_ERROR, Answer, command, complain, log_to_stderr, misused
from robojackson.cli.format_commands import export, import_
from robojackson.cli.learning_commands import evaluate, pretrain, train
from robojackson.cli.options import (
    Config,
    Folder,
    Force,
    Json,
    Minutes,
    Person,
    Quality,
    Robot,
    Seed,
    Set,
    Trainer,
    Weights,
    chosen,
    quoted,
)
from robojackson.cli.robot_commands import robots

app = typer.Typer(
    name="robojackson",
    help="A video of a dance in, a robot that dances it out.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


@app.command()
@command
def dance(
    source: Annotated[
        str | None,
        typer.Argument(help="A video, a folder of candidates, or the name of a dance to look for."),
    ] = None,
    minutes: Minutes = None,
    robot: Robot = None,
    trainer: Trainer = None,
    seed: Seed = None,
    person: Person = None,
    quality: Quality = None,
    start: Annotated[float | None, typer.Option(min=0, help="Trim: begin here, seconds.")] = None,
    end: Annotated[float | None, typer.Option(min=0, help="Trim: end here, seconds.")] = None,
    config: Config = "base",
    force: Force = False,
    set_: Set = None,
    as_json: Json = False,
) -> Answer:
    """A video in, a robot that dances it out: every stage, cached, and a page at the end."""
    from flows.runtime.environment import prepare
    from flows.search.dance_source import is_name, look_at, resolve, settle
    from robojackson.cli.stages import verdict_lines
    from storage.store import Store

    found = None if is_name(source) else resolve(source)
    given = {"minutes": minutes, "robot": robot, "train.trainer": trainer, "train.seed": seed}
    overrides = chosen(set_, given | {"dancer.number": person, "detector": quality})
    if force:
        overrides["gate"] = False
    settings = settle(config, overrides)
    if found is not None:
        look_at(found, settings, start, end)
    prepare(Store.from_environment())
    made = None
    if found is not None:
        from flows.video_pass.recorded_dance import replayed

        made = replayed(found, config, overrides, start, end)
    if made is None:
        from flows.dance import run

        made = run(str(found or source), config, overrides, start, end)
    text = [*verdict_lines(made["evaluation"]), f"page   {made['page']}", f"video  {made['video']}"]
    return Answer(made, text=text)


app.add_typer(robots, name="robots")
for other in (find, refresh, catalogue, ablation, metrics, deploy, backup, restore, server):
    app.command()(other)


@app.command()
@command
def score(
    video: Annotated[list[Path], typer.Argument(help="Videos, or folders of them.")],
    person: Person = None,
    config: Config = "base",
    set_: Set = None,
    as_json: Json = False,
) -> Answer:
    """How steady the dancer is seen (Algorithm 1): missing joints plus jitter, lowest is best.

    Exit code 1 where a video that is named cannot be read; one inside a folder is only told.
    """
    from robojackson.cli import scoring

    log_to_stderr()
    scored = scoring.score(video, config, chosen(set_, {"dancer.number": person}))
    unread = {told["video"] for told in scored["videos"] if "error" in told}
    return Answer(scored, code=1 if unread & set(map(str, video)) else 0)


@app.command()
@command
def mocap(
    video: Annotated[Path, typer.Argument(help="A video of one person.")],
    out: Folder,
    hybrik: Weights = None,
    niki: Weights = None,
    person: Person = None,
    quality: Quality = None,
    people: Annotated[
        bool, typer.Option("--people", help="Only list who is there, with a picture.")
    ] = False,
    hypotheses: Annotated[
        int, typer.Option(min=0, max=100, help="Also sample what hidden limbs may do: smpl_1...")
    ] = 0,
    config: Config = "base",
    set_: Set = None,
    as_json: Json = False,
) -> Answer:
    """The motion of the person in a video: landmarks.parquet and smpl.parquet."""
    from robojackson.cli import stages as single

    log_to_stderr()
    if people:
        from robojackson.cli.people_listing import list_people

        told, lines = list_people(video, out, config, chosen(set_))
        return Answer(told, text=lines)
    brought = {"network.hybrik": quoted(hybrik), "network.niki": quoted(niki)}
    overrides = chosen(set_, {**brought, "dancer.number": person, "detector": quality})
    return Answer(single.mocap(video, out, config, overrides, hypotheses))


@app.command()
@command
def retarget(
    smpl: Annotated[Path, typer.Argument(help="smpl.parquet of `robojackson mocap`.")],
    out: Folder,
    robot: Robot = None,
    method: Annotated[
        Literal["optimise", "paper", "framefix"] | None,
        typer.Option(help="Ours, the paper's Table I, or that with its axes corrected."),
    ] = None,
    video: Annotated[
        bool, typer.Option("--video", help="Also draw it: a video, the contacts, the torques.")
    ] = False,
    config: Config = "base",
    force: Force = False,
    set_: Set = None,
    as_json: Json = False,
) -> Answer:
    """The same motion for a robot: reference.parquet and scorecard.json."""
    from robojackson.cli import stages as single

    os.environ.setdefault("OMP_NUM_THREADS", "1")
    log_to_stderr()
    overrides = chosen(set_, {"retarget.method": method, "robot": robot})
    made = single.retarget(smpl, out, config, overrides)
    if video:
        from robojackson.cli.retarget_pictures import look

        made |= look(smpl, out, config, overrides)
    if not force:
        single.gate(made["scorecard"], out, config, overrides)
    return Answer(made)


app.command("import")(import_)
app.command()(export)
app.command()(train)
app.command()(pretrain)
app.command()(evaluate)


@app.command()
@command
def doctor(as_json: Json = False) -> Answer:
    """What is installed, what is missing, and how to get it."""
    from robojackson.cli.doctor import examine

    report = examine()
    return Answer(report, code=0 if report["ok"] else 1)


def main() -> int:
    """Run the command that the words of the process ask for; its exit code."""
    try:
        return app(standalone_mode=False) or 0
    except USAGE_ERROR as cause:
        if type(cause).__name__ == "NoArgsIsHelpError":
            cause.show()
        else:
            complain(misused(cause))
        return 2
