"""Start a command: nothing heavy is imported before Ctrl-C is guarded."""

import atexit
import io
import os
import sys
import threading
from collections.abc import Callable
from typing import NoReturn

from robojackson.cli.library_output import set_variables
from robojackson.cli.lifetime.interruption import INTERRUPTED, complain, conclude, same_command
from robojackson.cli.lifetime.supervisor import guarded
from robojackson.cli.lifetime.variables import check_environment, quieten
from robojackson.errors import BadConfiguration


def start(command: Callable[[], int]) -> NoReturn:
    """Run a command under a supervisor and end the process with its exit code.

    Where MUJOCO_GL is not set, MuJoCo imports no window library (GLFW starts a child process to
    find its own library, and Ctrl-C would end it with a traceback); `report.video` creates its own
    context.

    Args:
        command: Function that imports its dependencies in its body and returns the exit code.
    """
    end = End()
    atexit.register(end.leave)  # first registered, last run
    try:
        check_environment(os.environ)
    except BadConfiguration as cause:
        complain(f"{type(cause).__name__}: {cause}")
        sys.exit(1)
    quieten(os.environ)
    set_variables()
    _replace_letters()
    if sys.platform == "linux":
        os.environ["MUJOCO_GL"] = os.environ.get("MUJOCO_GL") or "disable"
    end.code = guarded(lambda: _run(command))
    end.finish()
    sys.exit(end.code)


def _replace_letters() -> None:
    """Print `?` for a letter that the terminal's encoding has not, as in a locale of Latin-1."""
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="replace")


def _wait_for_threads() -> None:
    """Wait for threads that are not daemons, as Python does at its end."""
    for thread in threading.enumerate():
        if thread is not threading.current_thread() and not thread.daemon:
            thread.join()


def _end_processes() -> None:
    """End the processes that this one has for videos, as Python does at its end."""
    if VIDEOS in sys.modules:
        sys.modules[VIDEOS].end_idle()


VIDEOS = "robojackson.cli.lifetime.video_process"
NEEDS_ITS_END = "prefect"
"""The one library whose exit functions must run: they end its server."""


class End:
    """Ends the process without the exit code of C++ libraries: neither the functions that they
    register with Python, as JAX does for its backends, nor their destructors.

    On a busy machine these abort now and then ("terminate called without an active exception": one
    of their threads still runs), so that a finished command returns exit code 134.

    Attributes:
        code: Exit code of a finished command.
    """

    def __init__(self) -> None:
        self.code: int | None = None

    def finish(self) -> None:
        """Wait for threads and end the processes for videos, as Python does, and leave; nothing
        where a library is loaded whose exit functions must run."""
        if NEEDS_ITS_END not in sys.modules:
            _wait_for_threads()
            _end_processes()
            self.leave()

    def leave(self) -> None:
        """Flush the output streams and end; Python itself reports one that cannot be written."""
        if self.code is None:
            return
        try:
            for stream in (sys.stdout, sys.stderr):
                if stream is not None:
                    stream.flush()
        except (OSError, ValueError):
            return
        os._exit(self.code)


def _run(command: Callable[[], int]) -> int:
    try:
        return command()
    except KeyboardInterrupt:
        conclude(f"interrupted: resume: {same_command()}")
        return INTERRUPTED
