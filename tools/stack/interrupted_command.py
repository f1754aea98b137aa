"""A command that is started to be interrupted, and how it then ended (Linux)."""

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
CLIP = str(ROOT / "clips" / "hip_shake.mp4")
LIMIT_S = 300.0
"""After which a command is given up, seconds."""


@dataclass(frozen=True)
class End:
    """End of an interrupted command.

    Attributes:
        moment_s: When it was interrupted, seconds after its start.
        acknowledged_s, ended_s: Seconds from the signal to the first line about it, and to the end.
        saving: Whether it announced that a checkpoint is being saved.
        code: Exit code.
        lines: What it wrote after the signal.
        faults: What is wrong with it, empty if nothing is.
    """

    moment_s: float
    acknowledged_s: float
    ended_s: float
    saving: bool
    code: int
    lines: tuple[str, ...]
    faults: tuple[str, ...]


class Running:
    """A command with a store of its own, whose lines on stderr are read as they come."""

    def __init__(self, words: Sequence[str], store: Path) -> None:
        kept = {k: v for k, v in os.environ.items() if not k.startswith("PREFECT_")}
        environment = {**kept, "ROBOJACKSON_STORE": str(store), "OMP_NUM_THREADS": "1"}
        self._store = store
        self._lines: list[tuple[float, str]] = []
        self._changed = threading.Condition()
        self.began = time.monotonic()
        self.process = subprocess.Popen(
            [sys.executable, "-m", "robojackson", *words],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            cwd=ROOT,
            env=environment,
            start_new_session=True,
        )
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def wait_for(self, text: str, more: int = 0, limit_s: float = LIMIT_S) -> None:
        """Return when a line with the text and a number of lines after it have come.

        Raises:
            TimeoutError: They have not come; the message has the lines that have.
        """
        with self._changed:
            if not self._changed.wait_for(lambda: self._lines_from(text) > more, limit_s):
                raise TimeoutError(self.output())

    def wait_until_guarded(self, limit_s: float = LIMIT_S) -> None:
        """Return when the command's supervisor has started its worker, and so takes signals.

        Raises:
            TimeoutError: It has not.
        """
        deadline = time.monotonic() + limit_s
        while time.monotonic() < deadline:
            if self.process.pid in parents():
                return
            time.sleep(0.01)
        raise TimeoutError(self.output())

    def output(self) -> str:
        """Return the lines so far."""
        return "\n".join(line for _, line in self._lines)

    def interrupt(self, how: signal.Signals = signal.SIGINT, alone: bool = False) -> float:
        """Send the signal to the process group, or to the process alone; return when."""
        sent = time.monotonic()
        (os.kill if alone else os.killpg)(self.process.pid, how)
        return sent

    def end(self, sent: float) -> End:
        """Return how the command ended after a signal."""
        code = self.process.wait(timeout=LIMIT_S)
        ended = time.monotonic()
        left = living_with(f"ROBOJACKSON_STORE={self._store}")
        self._reader.join()
        after = [(moment, line) for moment, line in self._lines if moment >= sent]
        first = next(((m, line) for m, line in after if "interrupted" in line), (float("inf"), ""))
        faults = [
            *([f"exit code {code}"] if code != 130 else []),
            *(["traceback"] if "Traceback" in self.output() else []),
            *(f"left: {pid} {words}" for pid, words in left.items()),
            *(f"half-written: {path}" for path in self._store.parent.rglob(".part-*")),
            *(
                ["no resume line"]
                if not after or "robojackson: interrupted: " not in after[-1][1]
                else []
            ),
        ]
        return End(
            sent - self.began,
            first[0] - sent,
            ended - sent,
            any("saving" in line for _, line in after),
            code,
            tuple(line for _, line in after),
            tuple(faults),
        )

    def _lines_from(self, text: str) -> int:
        """Return the number of lines from the first one with a text on."""
        lines = [line for _, line in self._lines]
        return next((len(lines) - i for i, line in enumerate(lines) if text in line), 0)

    def _read(self) -> None:
        assert self.process.stderr is not None
        for line in self.process.stderr:
            with self._changed:
                self._lines.append((time.monotonic(), line.rstrip()))
                self._changed.notify_all()


def parents() -> set[int]:
    """Return the parents of all living processes."""
    found = set()
    for stat in Path("/proc").glob("[0-9]*/stat"):
        with suppress(OSError):  # ended meanwhile
            found.add(int(stat.read_text().rpartition(")")[2].split()[1]))
    return found


def living_with(variable: str) -> dict[int, str]:
    """Return the words of the living processes that were started in such an environment, by id."""
    found = {}
    for folder in Path("/proc").iterdir():
        try:
            if folder.name.isdigit() and variable.encode() in _environment(folder):
                words = (folder / "cmdline").read_bytes().replace(b"\0", b" ").decode()
                found[int(folder.name)] = words.strip()
        except OSError:  # ended meanwhile, or another user's
            continue
    return found


def _environment(folder: Path) -> list[bytes]:
    return (folder / "environ").read_bytes().split(b"\0")
