"""The temporary Prefect server of a command, which begins while the flow is imported.

Prefect starts one by itself where none is named, but imports the whole server into the command
before that, and the flow first. Here its process begins at once, on a socket that already listens:
the first request waits until the server answers.
"""

import atexit
import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from select import select
from socket import create_server

from robojackson.errors import DeploymentFailed

PROCESS = Path(__file__).with_name("server_process.py")
HOST = "127.0.0.1"
GRACE_S = 5.0
"""Time from SIGTERM to SIGKILL, seconds."""


@contextmanager
def temporary_server() -> Iterator[None]:
    """Yield with a Prefect server of one's own, unless one is named or none is allowed.

    Prefect's settings name it inside; the environment does not. It lives until this process ends,
    for the last lines of Prefect's log are sent then. Import the flow inside.

    Raises:
        DeploymentFailed: the server does not start, or what the flow raises.
    """
    from prefect.settings import (
        PREFECT_API_REQUEST_TIMEOUT,
        PREFECT_API_URL,
        PREFECT_HOME,
        PREFECT_SERVER_EPHEMERAL_ENABLED,
        PREFECT_SERVER_EPHEMERAL_STARTUP_TIMEOUT_SECONDS,
        PREFECT_UI_URL,
        temporary_settings,
    )

    if PREFECT_API_URL.value() or not PREFECT_SERVER_EPHEMERAL_ENABLED.value():
        yield
        return
    server = _Server()
    settings = {
        PREFECT_API_URL: f"{server.address}/api",
        PREFECT_UI_URL: "",  # it has no pages, to which lines would point
        PREFECT_API_REQUEST_TIMEOUT: max(  # the first request waits for its start
            float(PREFECT_API_REQUEST_TIMEOUT.value()),
            float(PREFECT_SERVER_EPHEMERAL_STARTUP_TIMEOUT_SECONDS.value()),
        ),
    }
    with temporary_settings(settings):
        try:
            yield
        except DeploymentFailed as cause:
            reason = server.reason()
            if not reason:
                raise
            raise DeploymentFailed(
                f"the temporary Prefect server does not start: {reason}; move its database away "
                f"(prefect.db* in {PREFECT_HOME.value()}; results stay, the history of runs is in "
                "it), or name another server with PREFECT_API_URL"
            ) from cause


class _Server:
    """A server that begins; it ends with this process.

    Attributes:
        address: Its address.
    """

    def __init__(self) -> None:
        self._reason, pipe = os.pipe()
        with create_server((HOST, 0)) as listening:
            self.address = f"http://{HOST}:{listening.getsockname()[1]}"
            descriptors = (listening.fileno(), pipe)
            # -P: the modules beside that file are none of the server's.
            command = [sys.executable, "-P", str(PROCESS), *map(str, descriptors)]
            self._process = subprocess.Popen(command, pass_fds=descriptors)
        os.close(pipe)
        atexit.register(self._end)

    def reason(self) -> str:
        """Return why it has not started; nothing where it lives or was killed.

        The reason is there before the socket is closed, and that before the process has ended.
        """
        written, _, _ = select([self._reason], [], [], 0.0)
        return os.read(self._reason, 4096).decode(errors="replace") if written else ""

    def _end(self) -> None:
        self._process.terminate()
        try:
            self._process.wait(GRACE_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
