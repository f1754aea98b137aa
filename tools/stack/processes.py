"""The processes of a stack, found by the home that each of its services has (Linux)."""

import os
import signal
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Found:
    """A process that is alive.

    Attributes:
        pid: Process id.
        command: Words of the command.
        home: The folder that it calls home.
    """

    pid: int
    command: str
    home: Path

    def kill(self) -> bool:
        """Stop a process, see it stopped, then send SIGKILL; return whether that ended it."""
        with suppress(ProcessLookupError):
            os.kill(self.pid, signal.SIGSTOP)
            stopped = _holds(lambda: _state(self.pid) in STOPPED)
            os.kill(self.pid, signal.SIGKILL)
            return stopped and _holds(lambda: _state(self.pid) in DEAD)
        return False


STOPPED, DEAD = ("T", "t"), ("", "Z", "X")
"""States of the kernel: stopped by a signal; gone, or waiting to be reaped."""
SOON_S = 5.0


def under(folder: Path) -> list[Found]:
    """Return every living process whose home is in a folder."""
    return sorted((f for f in _all() if f.home.is_relative_to(folder)), key=lambda f: f.pid)


def _all() -> Iterator[Found]:
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit() and (home := _home(entry)):
            words = (entry / "cmdline").read_bytes() if entry.exists() else b""
            if words:  # a dead process that was not reaped yet has none
                command = words.replace(b"\0", b" ").decode(errors="replace").strip()
                yield Found(int(entry.name), command, home)


def _home(entry: Path) -> Path | None:
    try:
        given = (entry / "environ").read_bytes().split(b"\0")
    except OSError:  # ended meanwhile, or another user's
        return None
    return next((Path(os.fsdecode(e[5:])) for e in given if e.startswith(b"HOME=")), None)


def _state(pid: int) -> str:
    """Return the kernel's letter for a process, empty when there is none."""
    try:
        return (Path("/proc") / str(pid) / "stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        return ""


def _holds(question: Callable[[], bool]) -> bool:
    """Return whether a condition becomes true soon."""
    end = time.monotonic() + SOON_S
    while not question() and time.monotonic() < end:
        time.sleep(0.01)
    return question()


def forks(pid: int) -> set[int]:
    """Return the children of a process that run its own command: what a supervisor guards."""
    entries = [entry for entry in Path("/proc").iterdir() if entry.name.isdigit()]
    command = _command(Path(f"/proc/{pid}"))
    return {int(e.name) for e in entries if _parent(e) == pid and _command(e) == command}


def _command(entry: Path) -> bytes:
    with suppress(OSError):
        return (entry / "cmdline").read_bytes()
    return b""


def _parent(entry: Path) -> int:
    with suppress(OSError):
        return int((entry / "stat").read_text().rpartition(")")[2].split()[1])
    return 0


def cpu_seconds(pid: int) -> float:
    """Return the processor time of a process and of all below it, those that have ended
    included."""
    children: dict[int, list[int]] = {}
    used: dict[int, float] = {}
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            with suppress(OSError):
                fields = (entry / "stat").read_text().rpartition(")")[2].split()
                children.setdefault(int(fields[1]), []).append(int(entry.name))
                used[int(entry.name)] = sum(map(int, fields[11:15])) / os.sysconf("SC_CLK_TCK")
    below = [pid]
    for one in below:
        below += children.get(one, [])
    return sum(used.get(one, 0.0) for one in below)
