"""The `robojackson` command.

Every command imports what it needs inside itself, so that the one-stage commands run with no
Prefect in memory and `--help` answers at once.
"""

if __name__ == "__main__":  # Ctrl-C while the lines below are imported is told in one line, too
    from flows.start import main as start

    start()

import os
from pathlib import Path
from typing import Annotated, Literal

import typer

from flows.console import USAGE_ERROR, Answer, command, complain, log_to_stderr, misused
from flows.options import (
    Config,
    Folder,
    Json,
    Minutes,
    Robot,
    Seed,
    Set,
    SetTrain,
    Trainer,
    TrainMinutes,
    chosen,
)
from flows.search import catalogue, find, refresh

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
    robot: Annotated[str | None, typer.Option("--robot", help="Name of a robot.")] = None,
    trainer: Trainer = None,
    seed: Seed = None,
    start: Annotated[float | None, typer.Option(min=0, help="Trim: begin here, seconds.")] = None,
    end: Annotated[float | None, typer.Option(min=0, help="Trim: end here, seconds.")] = None,
    config: Config = "base",
    set_: Set = None,
    as_json: Json = False,
) -> Answer:
    """A video in, a robot that dances it out: every stage, cached, and a page at the end."""
    from flows.environment import prepare
    from flows.single import verdict_lines
    from flows.source import is_name, look_at, resolve, settle
    from storage.store import Store

    found = None if is_name(source) else resolve(source)
    given = {"minutes": minutes, "robot": robot, "train.trainer": trainer, "train.seed": seed}
    overrides = chosen(set_, given)
    settings = settle(config, overrides)
    if found is not None:
        look_at(found, settings, start, end)
    prepare(Store.from_environment())
    from flows.dance import run

    if found is None:
        from flows.find import clip_of

        found = clip_of(str(source))

    made = run(found, config, overrides, start, end)
    text = [*verdict_lines(made["evaluation"]), f"page   {made['page']}", f"video  {made['video']}"]
    return Answer(made, text=text)


for searching in (find, refresh, catalogue):
    app.command()(searching)


@app.command()
@command
def score(
    video: Annotated[list[Path], typer.Argument(help="Videos, or folders of them.")],
    config: Config = "base",
    set_: Set = None,
    as_json: Json = False,
) -> Answer:
    """How steady the dancer is seen (Algorithm 1): missing joints plus jitter, lowest is best."""
    from flows import single

    log_to_stderr()
    return Answer(single.score(video, config, chosen(set_)))


@app.command()
@command
def mocap(
    video: Annotated[Path, typer.Argument(help="A video of one person.")],
    out: Folder,
    config: Config = "base",
    set_: Set = None,
    as_json: Json = False,
) -> Answer:
    """The motion of the person in a video: landmarks.parquet and smpl.parquet."""
    from flows import single

    log_to_stderr()
    return Answer(single.mocap(video, out, config, chosen(set_)))


@app.command()
@command
def retarget(
    smpl: Annotated[Path, typer.Argument(help="smpl.parquet of `robojackson mocap`.")],
    out: Folder,
    robot: Robot = "humanoid",
    method: Annotated[
        Literal["optimise", "paper"] | None, typer.Option(help="Ours, or the paper's Table I.")
    ] = None,
    video: Annotated[
        bool, typer.Option("--video", help="Also draw it: a video, the contacts, the torques.")
    ] = False,
    config: Config = "base",
    set_: Set = None,
    as_json: Json = False,
) -> Answer:
    """The same motion for a robot: reference.parquet and scorecard.json."""
    from flows import single

    log_to_stderr()
    overrides = chosen(set_, {"retarget.method": method})
    made = single.retarget(smpl, out, robot, config, overrides)
    if video:
        from flows.look import look

        made |= look(smpl, out, config, overrides)
    return Answer(made)


@app.command()
@command
def export(
    reference: Annotated[Path, typer.Argument(help="reference.parquet of `robojackson retarget`.")],
    to: Annotated[
        Literal["gmr", "csv", "beyondmimic", "locomujoco", "omniretarget", "keyframes"],
        typer.Option(help="The format; docs/formats.md says who reads it."),
    ],
    out: Annotated[Path, typer.Option("-o", "--out", help="File for the result.")],
    as_json: Json = False,
) -> Answer:
    """The robot's motion in the file format of another project."""
    from flows import export as exporting

    log_to_stderr()
    return Answer(exporting.export(reference, to, out))


@app.command()
@command
def train(
    reference: Annotated[Path, typer.Argument(help="reference.parquet of `robojackson retarget`.")],
    out: Folder,
    trainer: Trainer = None,
    steps: Annotated[int | None, typer.Option(min=1, help="Control steps in all.")] = None,
    minutes: TrainMinutes = None,
    seed: Seed = None,
    setup: Annotated[
        str | None, typer.Option(help="Path of a training configuration, or setups/NAME.")
    ] = None,
    run_id: Annotated[str, typer.Option(help="Name of the run in the tables.")] = "",
    move: Annotated[str, typer.Option(help="Name of the dance in the tables.")] = "",
    parent: Annotated[int, typer.Option(hidden=True, help="End with this process.")] = 0,
    set_: SetTrain = None,
    as_json: Json = False,
) -> Answer:
    """Teach the robot the motion: policy.safetensors and episodes.parquet; resumes by itself."""
    from flows import training

    if parent:
        training.die_with(parent)
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    log_to_stderr()
    given = {"trainer": trainer, "steps": steps, "minutes": minutes, "seed": seed}
    return Answer(training.train(reference, out, setup, chosen(set_, given), run_id, move))


@app.command()
@command
def evaluate(
    policy: Annotated[Path, typer.Argument(help="policy.safetensors of `robojackson train`.")],
    reference: Annotated[Path, typer.Argument(help="The reference.parquet it was trained on.")],
    seconds: Annotated[float | None, typer.Option(min=0.1, help="Length of a rollout, s.")] = None,
    out: Annotated[Path | None, typer.Option("-o", "--out", help="Folder for the tables.")] = None,
    config: Config = "base",
    set_: Set = None,
    as_json: Json = False,
) -> Answer:
    """Judge a policy on stock physics from many starts, beside baselines that do not dance."""
    from flows import single

    os.environ.setdefault("OMP_NUM_THREADS", "1")
    log_to_stderr()
    overrides = chosen(set_, {"evaluate.seconds": seconds})
    judged = single.evaluate(policy, reference, out, config, overrides)
    return Answer(judged, text=single.verdict_lines(judged))


@app.command()
@command
def doctor(as_json: Json = False) -> Answer:
    """What is installed, what is missing, and how to get it."""
    from flows.doctor import examine

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
