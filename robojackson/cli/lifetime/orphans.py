"""Find the processes that a command has started by a mark in their environment, and end them.

A temporary Prefect server is a child, which outlives a SIGKILL of its parent. So a small
process waits at the other end of a pipe: when the pipe closes without a farewell, it ends every
process with this flow's mark in its environment. Linux only; elsewhere it does nothing. Imports
only the standard library.
"""

import os
import signal
import sys
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

VARIABLE = "ROBOJACKSON_FLOW"
FAREWELL = b"all is well"
HALF_WRITTEN = ".part-"
"""Prefix of the names of files that are being written: `files.local_folder.TEMPORARY`, repeated
because only the standard library is imported here."""
GRACE_S = 35.0
"""Grace time of processes without a parent, in which a training saves, seconds."""
KILL_S = 0.5
"""Longest wait for killed processes to disappear, seconds."""


def new_mark() -> str:
    """Return a mark that no other process carries."""
    return f"{os.getpid()}-{os.urandom(8).hex()}"


@contextmanager
def none_left() -> Iterator[None]:
    """Make every process that is started inside end with this one, which may carry a mark
    already."""
    import subprocess

    if not Path("/proc/self/environ").exists():
        yield
        return
    given = os.environ.get(VARIABLE)
    mark = os.environ[VARIABLE] = given or new_mark()
    command = [sys.executable, "-S", "-E", __file__, mark]
    watch = subprocess.Popen(command, stdin=subprocess.PIPE, start_new_session=True)
    try:
        yield
    finally:
        if given is None:
            del os.environ[VARIABLE]
        watch.communicate(FAREWELL)


def marked(mark: str) -> set[int]:
    """Return the living processes with the mark, without this one."""
    variable = f"{VARIABLE}={mark}".encode()
    pids = (int(folder.name) for folder in Path("/proc").iterdir() if folder.name.isdigit())
    return {pid for pid in pids if variable in _environment(pid)} - {os.getpid()}


def end_all(mark: str, grace_s: float = GRACE_S) -> None:
    """Send SIGTERM to every process with the mark; after the grace time, kill the rest."""
    deadline = time.monotonic() + grace_s
    _signal(marked(mark), signal.SIGTERM)
    while marked(mark) and time.monotonic() < deadline:
        time.sleep(KILL_S / 5)
    kill_all(mark)


def kill_all(mark: str, *more: int) -> set[Path]:
    """Kill every process with the mark, and the given ones; return the files that they were
    writing."""
    deadline = time.monotonic() + KILL_S
    doomed = {*more, *marked(mark)}
    _signal(doomed, signal.SIGSTOP)  # so that none begins another file
    files = half_written(doomed)
    while doomed and time.monotonic() < deadline:
        _signal(doomed, signal.SIGKILL)
        doomed = marked(mark)
    return files


def half_written(pids: Iterable[int]) -> set[Path]:
    """Return the files with temporary names that processes have open."""
    files = {Path(name) for pid in pids for name in _open_files(pid)}
    return {file for file in files if file.name.startswith(HALF_WRITTEN)}


def holding(name: str, pids: Iterable[int]) -> set[int]:
    """Return those of the processes that hold a memory file of that name open."""
    return {pid for pid in pids if any(f.startswith(f"/memfd:{name} ") for f in _open_files(pid))}


def _signal(pids: Iterable[int], number: signal.Signals) -> None:
    for pid in pids:
        with suppress(ProcessLookupError):
            os.kill(pid, number)


def _environment(pid: int) -> list[bytes]:
    try:
        return Path(f"/proc/{pid}/environ").read_bytes().split(b"\0")
    except OSError:  # ended, or another user's
        return []


def _open_files(pid: int) -> Iterator[str]:
    """Yield the names of the files that a process has open."""
    folder = f"/proc/{pid}/fd"
    with suppress(OSError):  # as above
        for number in os.listdir(folder):
            with suppress(OSError):
                yield os.readlink(f"{folder}/{number}")


if __name__ == "__main__":
    if sys.stdin.buffer.read() != FAREWELL:
        end_all(sys.argv[1])
