"""Handle Ctrl-C and SIGTERM in the process that does the work; `supervisor` enforces the end.

Imports only the standard library, since this runs before everything else.
"""

import os
import shlex
import shutil
import signal
import sys
from collections.abc import Mapping, Sequence
from types import FrameType

from robojackson.cli.lifetime.orphans import VARIABLE
from robojackson.cli.lifetime.parent_death import end_with_parent

INTERRUPTED = 130
"""Exit code of a command that was interrupted."""
STOPS = (signal.SIGINT, signal.SIGTERM)
"""The signals that interrupt a command."""
SHOWN = "\u2068\u2069"
"""Unicode isolates around right-to-left words: they are ours."""
UNSAVED = "robojackson-unsaved"
"""Name of the memory file that a training holds open while it has unsaved learning."""

_last_line: int | None = None
"""In the worker of a supervisor, the pipe on which the supervisor receives the last line."""


class UnsavedFlag:
    """A flag of this process that its supervisor can see; the kernel clears it with the process."""

    def __init__(self) -> None:
        self._file: int | None = None

    @property
    def is_set(self) -> bool:
        """Whether the flag is set."""
        return self._file is not None

    def set(self) -> None:
        """Set the flag: there is learning that no checkpoint holds."""
        if self._file is None and sys.platform == "linux":
            self._file = os.memfd_create(UNSAVED)

    def clear(self) -> None:
        """Clear the flag."""
        if self._file is not None:
            os.close(self._file)
            self._file = None


def is_guarded() -> bool:
    """Return whether another process of ours enforces the end of this one."""
    return VARIABLE in os.environ or "--parent" in sys.argv


def conclude(line: str) -> None:
    """Leave the last line of an interrupted command to the supervisor; without one, write it."""
    if _last_line is None:
        complain(line)
    else:
        os.write(_last_line, line.encode(errors="backslashreplace"))


def complain(line: str) -> None:
    """Write one line about an error on stderr."""
    sys.stderr.write(f"{as_line(line)}\n")


def as_line(text: str) -> str:
    """Return a text as one printable line that names the command."""
    return f"robojackson: {printable(' '.join(text.split()))}"


def printable(text: str) -> str:
    """Return a text without control characters: names of files may hold escape sequences."""
    return "".join(c if c.isprintable() or c in SHOWN else "?" for c in text)


def program() -> str:
    """Return the command that starts this program: its path where its name alone is not found.

    `make dance` runs it from an environment that the person's shell has not activated.
    """
    name, path = "robojackson", sys.argv[0]
    if os.path.basename(path) != name or shutil.which(name) is not None:
        return name
    inside = os.path.relpath(path)
    return path if inside.startswith(os.pardir) else inside


def python() -> str:
    """Return the command that starts Python: Debian has no `python` outside an environment."""
    return next((name for name in ("python", "python3") if shutil.which(name)), sys.executable)


def same_command() -> str:
    """Return the command line of this process, to be typed again."""
    return shlex.join([program(), *sys.argv[1:]])


def with_option(
    option: str, value: str, without: tuple[str, ...] = (), unset: tuple[str, ...] = ()
) -> str:
    """Return the command line of this process with another value of an option.

    Args:
        without: Options with a value that the line has no longer.
        unset: Keys that no `--set` of the line gives any longer, since it would win.
    """
    words = _without_settings(sys.argv[1:], unset)
    for name in (option, *without):
        for place, word in enumerate(words):
            if word == name or word.startswith(f"{name}="):
                del words[place : place + (2 if word == name else 1)]
                break
    return shlex.join([program(), *words, option, value])


def with_settings(values: Mapping[str, str]) -> str:
    """Return the command line of this process with other values of `--set`, by key."""
    words = _without_settings(sys.argv[1:], tuple(values))
    for key, value in values.items():
        words += ["--set", f"{key}={value}"]
    return shlex.join([program(), *words])


def _without_settings(words: Sequence[str], keys: tuple[str, ...]) -> list[str]:
    """Return the words without every `--set` of some keys."""
    kept: list[str] = []
    left = list(words)
    while left:
        size = 2 if left[0] == "--set" and len(left) > 1 else 1
        pair = left[1] if size == 2 else left[0].removeprefix("--set=")
        is_setting = size == 2 or left[0].startswith("--set=")
        if not (is_setting and pair.partition("=")[0] in keys):
            kept += left[:size]
        del left[:size]
    return kept


def become_worker(supervisor: int, mark: str, last_line: int) -> None:
    """Prepare a fork of the supervisor for the command: its group, mark, signals and input.

    A background process that reads from the terminal would be stopped; no command reads.

    Args:
        supervisor: Process id of the supervisor, with which this process ends.
        mark: Mark of the processes that this one starts (`orphans`).
        last_line: File descriptor on which the supervisor receives the last line.
    """
    global _last_line
    _last_line = last_line
    os.setpgid(0, 0)
    if not end_with_parent(supervisor):
        os._exit(INTERRUPTED)
    os.environ[VARIABLE] = mark
    signal.signal(signal.SIGTTOU, signal.SIG_IGN)
    if os.isatty(0):
        _discard(0)
    for number in STOPS:
        signal.signal(number, _interrupt)


def _interrupt(number: int, frame: FrameType | None) -> None:
    """Raise KeyboardInterrupt in the worker, which writes nothing afterwards."""
    for stop in STOPS:
        signal.signal(stop, signal.SIG_IGN)
    _discard(1, 2)
    raise KeyboardInterrupt


def _discard(*files: int) -> None:
    """Connect file descriptors to the null device."""
    null = os.open(os.devnull, os.O_RDWR)
    for file in files:
        os.dup2(null, file)
    os.close(null)
