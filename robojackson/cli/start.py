"""Where a command starts: nothing heavy is imported before Ctrl-C is guarded."""

import atexit
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

    Where MUJOCO_GL is not set, MuJoCo imports no window library (GLFW starts a process to look for
    its own, which Ctrl-C would end with a traceback); `report.video` brings its own context.

    Args:
        command: Imports what it needs inside itself; returns the exit code.
    """
    end = _End()
    atexit.register(end.leave)  # the first to be registered is the last to run
    try:
        check_environment(os.environ)
    except BadConfiguration as cause:
        complain(f"{type(cause).__name__}: {cause}")
        sys.exit(1)
    quieten(os.environ)
    set_variables()
    if sys.platform == "linux":
        os.environ["MUJOCO_GL"] = os.environ.get("MUJOCO_GL") or "disable"
    end.code = guarded(lambda: _run(command))
    if NEEDS_ITS_END not in sys.modules:
        _wait_for_threads()
        _end_processes()
        end.leave()
    sys.exit(end.code)


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
"""The one library whose functions at exit do what has to be done: they end its server."""


class _End:
    """Ends the process without the ends of C++ libraries: neither what they register with Python,
    as JAX does for its backends, nor their destructors.

    On a busy machine these abort now and then ("terminate called without an active exception": a
    thread of theirs still runs), which makes exit code 134 of a command that has done all its work.

    Attributes:
        code: Exit code of a command that came to its end.
    """

    def __init__(self) -> None:
        self.code: int | None = None

    def leave(self) -> None:
        """Write out what is buffered and end; where it cannot be written, Python says so itself."""
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
