"""Where the command starts: nothing heavy is imported before Ctrl-C is guarded."""

import sys

from robojackson.cli.lifetime.interruption import INTERRUPTED, conclude, same_command
from robojackson.cli.lifetime.supervisor import guarded


def main() -> None:
    """Run the console script and end the process."""
    sys.exit(guarded(_command))


def _command() -> int:
    try:
        from robojackson.cli.app import main as command

        return command()
    except KeyboardInterrupt:
        conclude(f"interrupted: resume: {same_command()}")
        return INTERRUPTED
