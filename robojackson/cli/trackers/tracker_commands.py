"""The commands about general trackers: `robojackson trackers`, and `add` below it.

Like `robojackson.cli.app`, each imports what it needs inside itself.
"""

from pathlib import Path
from typing import Annotated

import typer

from robojackson.cli.console import CommandResult, command, log_to_stderr
from robojackson.cli.options import Json

trackers = typer.Typer(help="Networks that make a robot follow any motion at once: list, add.")


@command
def show_trackers(as_json: Json = False) -> CommandResult:
    """The trackers of configs/trackers: robot, licence, training motions, whether it is here."""
    from robojackson.cli.trackers import tracker_files

    found = tracker_files.list_trackers()
    return CommandResult({"trackers": found}, text=tracker_files.tracker_lines(found))


@trackers.callback(invoke_without_command=True)
def listed(context: typer.Context, as_json: Json = False) -> None:
    """The trackers of configs/trackers; add gets the network of one."""
    if context.invoked_subcommand is None:
        show_trackers(as_json=as_json)


@trackers.command()
@command
def add(
    name: Annotated[str, typer.Argument(help="Name of a tracker of configs/trackers.")],
    file: Annotated[
        Path | None, typer.Option(help="A copy that you have; its sha256 is checked as well.")
    ] = None,
    as_json: Json = False,
) -> CommandResult:
    """Download the network of a tracker, check its size and sha256; a cut download goes on."""
    from robojackson.cli import cards
    from robojackson.cli.console import lines
    from robojackson.cli.trackers import tracker_files

    log_to_stderr()
    told = tracker_files.add_tracker(name, file)
    sentence = (
        f"The network of {name} is here; its licence: {told['licence']}. What its training motions "
        "allow is another question: docs/trackers.md."
    )
    following = cards.command_line("evaluate", name, "reference.parquet")
    closing = {"verdict": {"kind": "here", "sentence": sentence}, "next": following}
    return CommandResult(told | closing, text=[*lines(told), *cards.closing(closing)])
