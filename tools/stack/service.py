"""One service of a stack as a process with a health check, a log, and a group of its own."""

import re
import signal
import socket
import subprocess
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from robojackson.cli.lifetime.process_group import end_group, signal_group
from tools.stack.processes import forks

ROOT = Path(__file__).parents[2]
VARIABLE = re.compile(r"\$\{(\w+)(?:(:[?-])([^}]*))?\}")
HEALTHY_S = 600.0
SECONDS_TO_END = 15.0


class StackError(RuntimeError):
    """A service did not come up."""


@dataclass
class Service:
    """One process of the stack.

    Attributes:
        name: Name in the compose file, with a number behind it for a second one.
        command: Words of the process.
        environment: Whole environment of the process.
        check: Command that succeeds when the service is healthy; None for one that ends by itself.
        log: File that takes its output.
        user: Name of the user that runs it, if another than ours.
        grace_s: Time to end by itself before it is killed.
    """

    name: str
    command: list[str]
    environment: dict[str, str]
    check: list[str] | None
    log: Path
    user: str | None = None
    grace_s: float = SECONDS_TO_END
    process: subprocess.Popen[bytes] | None = None

    def start(self) -> None:
        """Start the process."""
        with self.log.open("ab") as out:
            self.process = subprocess.Popen(
                self.command,
                env=self.environment,
                cwd=ROOT,
                stdout=out,
                stderr=out,
                user=self.user,
                start_new_session=True,
            )

    def healthy(self) -> bool:
        """Return whether its health check succeeds; for a one-shot service, whether it ended
        well."""
        assert self.process is not None
        code = self.process.poll()
        if self.check is None:
            if code:
                raise StackError(f"{self.name} ended with {code}; see {self.log}")
            return code == 0
        if code is not None:
            raise StackError(f"{self.name} ended with {code}; see {self.log}")
        run = subprocess.run(self.check, env=self.environment, capture_output=True, check=False)
        return run.returncode == 0

    def wait(self, seconds: float = HEALTHY_S) -> None:
        """Return when it is healthy.

        Raises:
            StackError: it ended, or did not become healthy in time.
        """
        end = time.monotonic() + seconds
        while not self.healthy():
            if time.monotonic() > end:
                raise StackError(f"{self.name} is not healthy after {seconds:.0f} s; {self.log}")
            time.sleep(0.5)

    @property
    def pids(self) -> set[int]:
        """The process, and the one that runs the command where this one supervises it."""
        if self.process is None:
            return set()
        return {self.process.pid, *forks(self.process.pid)}

    def kill(self, how: signal.Signals = signal.SIGKILL) -> None:
        """Send a signal to the process and all its children."""
        if self.process is not None and self.process.poll() is None:
            signal_group(self.process.pid, how)

    def murder(self) -> bool:
        """Send SIGKILL; return whether that ended the process."""
        if self.process is None or self.process.poll() is not None:
            return False
        self.kill()
        return self.process.wait(SECONDS_TO_END) == -signal.SIGKILL

    def stop(self) -> None:
        """End it: SIGTERM, wait, SIGKILL."""
        if self.process is not None:
            request = signal.SIGINT if self.user else signal.SIGTERM
            end_group(self.process, self.grace_s, request)


def interpolate(value: Any, given: Mapping[str, str]) -> Any:
    """Return the compose's `${NAME:?message}` and `${NAME:-default}` in all strings of a value.

    Raises:
        StackError: a variable that must be set is not.
    """
    if isinstance(value, dict):
        return {key: interpolate(inner, given) for key, inner in value.items()}
    if isinstance(value, list):
        return [interpolate(inner, given) for inner in value]
    return VARIABLE.sub(lambda m: _variable(m, given), value) if isinstance(value, str) else value


def _variable(found: re.Match[str], given: Mapping[str, str]) -> str:
    name, kind, text = found.groups()
    if given.get(name):
        return given[name]
    if kind == ":?":
        raise StackError(f"required variable {name} is missing a value: {text}")
    return text or ""


def free_port() -> int:
    """Return a port on which nothing listens now."""
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        return int(found.getsockname()[1])
