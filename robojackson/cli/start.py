"""Where a command starts: nothing heavy is imported before Ctrl-C is guarded."""

import sys
from collections.abc import Callable
from typing import NoReturn

from robojackson.cli.lifetime.interruption import INTERRUPTED, conclude, same_command
from robojackson.cli.lifetime.supervisor import guarded


def start(command: Callable[[], int]) -> NoReturn:
    """Run a command under a supervisor and end the process with its exit code.

    Args:
        command: Imports what it needs inside itself; returns the exit code.
    """
    sys.exit(guarded(lambda: _run(command)))


def _run(command: Callable[[], int]) -> int:
    try:
        return command()
    except KeyboardInterrupt:
        conclude(f"interrupted: resume: {same_command()}")
        return INTERRUPTED
