"""The commands about general trackers: `robojackson trackers` with `add`.

Like `robojackson.cli.app`, each command imports its dependencies in its body.
"""

from pathlib import Path
from typing import Annotated

import typer

from robojackson.cli.console import CommandResult, command, log_to_stderr
from robojackson.cli.options import Json

trackers = typer.Typer(
    help="List general trackers, which follow any motion without training; add one."
)


@command
def show_trackers(as_json: Json = False) -> CommandResult:
    """List the trackers of configs/trackers: robot, licence, training motions, whether
    installed."""
    from robojackson.cli.trackers import tracker_files

    found = tracker_files.list_trackers()
    return CommandResult({"trackers": found}, text=tracker_files.tracker_lines(found))


@trackers.callback(invoke_without_command=True)
def listed(context: typer.Context, as_json: Json = False) -> None:
    """List the trackers of configs/trackers; add downloads the network of one."""
    if context.invoked_subcommand is None:
        show_trackers(as_json=as_json)
    elif as_json:
        raise typer.BadParameter("give --json after the subcommand", param_hint="--json")


@trackers.command()
@command
def add(
    name: Annotated[str, typer.Argument(help="Name of a tracker of configs/trackers.")],
    file: Annotated[
        Path | None, typer.Option(help="A copy that you have; its sha256 is checked as well.")
    ] = None,
    as_json: Json = False,
) -> CommandResult:
    """Download the network of a tracker, check its size and sha256; resume a cut download."""
    from robojackson.cli import cards
    from robojackson.cli.console import lines
    from robojackson.cli.trackers import tracker_files

    log_to_stderr()
    data = tracker_files.add_tracker(name, file)
    sentence = (
        f"The network of {name} is installed; its licence: {data['licence']}. What its "
        "training motions allow is a separate question: docs/trackers.md."
    )
    following = cards.command_line("evaluate", name, "reference.parquet")
    closing = {"verdict": {"kind": "here", "sentence": sentence}, "next": following}
    return CommandResult(data | closing, text=[*lines(data), *cards.closing(closing)])
