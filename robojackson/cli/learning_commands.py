"""The commands `train`, `pretrain` and `evaluate`.

Like `robojackson.cli.app`, each command imports its dependencies in its body.
"""

import os
from pathlib import Path
from typing import Annotated, Literal

import typer

from robojackson.cli.console import CommandResult, command, log_to_stderr
from robojackson.cli.options import (
    Config,
    Folder,
    Force,
    Json,
    MotionRobot,
    Robot,
    Seed,
    Set,
    SetTrain,
    Setup,
    TablesFolder,
    TrainConfigFile,
    Trainer,
    TrainMinutes,
    Verbose,
    overrides_from,
)

Parent = Annotated[int, typer.Option(hidden=True, help="End with this process.")]


@command
def train(
    reference: Annotated[Path, typer.Argument(help="reference.parquet of `robojackson retarget`.")],
    out: Folder,
    robot: MotionRobot = None,
    mode: Annotated[
        Literal["track", "paper"] | None, typer.Option(help="Ours, or the paper's.")
    ] = None,
    trainer: Trainer = None,
    steps: Annotated[int | None, typer.Option(min=1, help="Policy steps in all.")] = None,
    minutes: TrainMinutes = None,
    seed: Seed = None,
    setup: Setup = None,
    config: TrainConfigFile = None,
    robust: Annotated[
        bool,
        typer.Option(
            help="Vary friction, masses, gains and delays; noise and pushes. A robot with feedback "
            "observes what it measures itself."
        ),
    ] = False,
    run_id: Annotated[str, typer.Option(help="Name of the run in the tables.")] = "",
    move: Annotated[str, typer.Option(help="Name of the dance in the tables.")] = "",
    parent: Parent = 0,
    force: Force = False,
    set_: SetTrain = None,
    verbose: Verbose = False,
    as_json: Json = False,
) -> CommandResult:
    """Train a policy to follow a motion: policy.safetensors, episodes.parquet; resumes by
    itself."""
    from robojackson.cli import cards
    from robojackson.cli.learning import training_process, training_request

    if parent:
        training_process.end_with(parent)
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    log_to_stderr()
    given: dict[str, object] = {
        "mode": mode, "trainer": trainer, "steps": steps, "minutes": minutes, "seed": seed
    }  # fmt: skip
    overrides = overrides_from(set_, given)
    if robust:
        overrides = training_request.robust(reference, robot, config, setup, overrides)
    trained = training_process.train(
        reference, out, setup, overrides, run_id, move, force, robot, config
    )
    return CommandResult(trained, text=cards.shown(trained, cards.train_lines(trained), verbose))


@command
def pretrain(
    out: Folder,
    kind: Annotated[
        Literal["track", "paper"], typer.Option(help="The mode whose trainings start from it.")
    ] = "track",
    reference: Annotated[
        Path | None, typer.Option(help="Motion to imitate (track); the bundled walk by default.")
    ] = None,
    robot: Robot = None,
    steps: Annotated[int | None, typer.Option(min=1, help="Policy steps in all.")] = None,
    minutes: TrainMinutes = None,
    trainer: Trainer = None,
    seed: Seed = None,
    parent: Parent = 0,
    set_: SetTrain = None,
    as_json: Json = False,
) -> CommandResult:
    """Train a robot that walks, for `--setup pretrain`: walker_KIND.safetensors and walker.json."""
    from robojackson.cli.learning import walker_training
    from robojackson.cli.learning.training_process import end_with

    if parent:
        end_with(parent)
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    log_to_stderr()
    given = {"trainer": trainer, "steps": steps, "minutes": minutes, "seed": seed}
    return CommandResult(
        walker_training.pretrain(kind, out, reference, overrides_from(set_, given), robot)
    )


@command
def evaluate(
    policy: Annotated[
        Path,
        typer.Argument(
            help="policy.safetensors of `robojackson train`, or the name of a tracker "
            "(`robojackson trackers`)."
        ),
    ],
    reference: Annotated[
        Path, typer.Argument(help="The reference.parquet it was trained on; a tracker takes any.")
    ],
    robot: MotionRobot = None,
    seconds: Annotated[float | None, typer.Option(min=0.1, help="Length of a rollout, s.")] = None,
    passport: Annotated[
        bool,
        typer.Option(help="Also under other friction, masses, gains, delays, noise and pushes."),
    ] = False,
    out: TablesFolder = None,
    config: Config = "base",
    parent: Parent = 0,
    set_: Set = None,
    verbose: Verbose = False,
    as_json: Json = False,
) -> CommandResult:
    """Evaluate a policy or a tracker on stock physics from many starts, beside simple baselines."""
    from robojackson.cli import cards, stages
    from robojackson.cli.learning.training_process import end_with
    from robojackson.cli.passport_text import passport_lines
    from robojackson.report.pages.closeness import sentences

    if parent:
        end_with(parent)
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    log_to_stderr()
    given = {"evaluate.seconds": seconds, "evaluate.passport": passport or None}
    overrides = overrides_from(set_, given)
    evaluated = stages.evaluate(policy, reference, out, config, overrides, robot)
    closely = sentences(evaluated)
    lines = [*stages.verdict_lines(evaluated), *closely, *passport_lines(evaluated)]
    table = [*lines, *cards.closing(evaluated)]
    return CommandResult(evaluated, text=cards.shown(evaluated, table, verbose))
