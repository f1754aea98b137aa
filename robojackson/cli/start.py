"""Where a command starts: nothing heavy is imported before Ctrl-C is guarded."""

import os
import sys
from collections.abc import Callable
from typing import NoReturn

from robojackson.cli.library_output import set_variables
from robojackson.cli.lifetime.interruption import INTERRUPTED, conclude, same_command
from robojackson.cli.lifetime.supervisor import guarded


def start(command: Callable[[], int]) -> NoReturn:
    """Run a command under a supervisor and end the process with its exit code.

    Where MUJOCO_GL is not set, MuJoCo imports no window library (GLFW starts a process to look for
    its own, which Ctrl-C would end with a traceback); `report.video` brings its own context.

    Args:
        command: Imports what it needs inside itself; returns the exit code.
    """
    set_variables()
    if sys.platform == "linux":
        os.environ.setdefault("MUJOCO_GL", "disable")
    sys.exit(guarded(lambda: _run(command)))


def _run(command: Callable[[], int]) -> int:
    try:
        return command()
    except KeyboardInterrupt:
        conclude(f"interrupted: resume: {same_command()}")
        return INTERRUPTED
