"""One service of a stack as a process with a health check, a log, and a group of its own."""

import random
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
LOG_LINES = 15
"""Of a service that ended: how many last lines of its log its error shows."""
LISTENING = range(15_000, 32_000)
"""Ports below those that Linux gives to outgoing connections (`ip_local_port_range`, from 32,768):
no connection of this machine takes one before its service listens on it."""
_handed_out: set[int] = set()


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
        restarts: How often it is started again when it ends with an error before it is healthy, as
            the compose file's `restart` does.
    """

    name: str
    command: list[str]
    environment: dict[str, str]
    check: list[str] | None
    log: Path
    user: str | None = None
    grace_s: float = SECONDS_TO_END
    restarts: int = 0
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
                raise self._ended(code)
            return code == 0
        if code is not None:
            raise self._ended(code)
        run = subprocess.run(self.check, env=self.environment, capture_output=True, check=False)
        return run.returncode == 0

    def wait(self, seconds: float = HEALTHY_S) -> None:
        """Return when it is healthy.

        Raises:
            StackError: it ended, or did not become healthy in time.
        """
        end = time.monotonic() + seconds
        left = self.restarts
        while True:
            try:
                if self.healthy():
                    return
            except StackError:
                if not left:
                    raise
                left -= 1
                self.start()
            if time.monotonic() > end:
                raise StackError(f"{self.name} is not healthy after {seconds:.0f} s; {self.log}")
            time.sleep(0.5)

    def _ended(self, code: int) -> StackError:
        lines = self.log.read_text(errors="replace").splitlines()[-LOG_LINES:]
        return StackError("\n".join([f"{self.name} ended with {code}; {self.log}:", *lines]))

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
    """Return a port on which nothing listens now, each one once.

    Raises:
        StackError: every port that was tried is taken.
    """
    for port in random.SystemRandom().sample(LISTENING, len(LISTENING)):
        if port not in _handed_out and _is_free(port):
            _handed_out.add(port)
            return port
    raise StackError(f"no port from {LISTENING.start} to {LISTENING.stop - 1} is free")


def _is_free(port: int) -> bool:
    with socket.socket() as found:
        try:
            found.bind(("127.0.0.1", port))
        except OSError:
            return False
        return True
