"""A flow from the command line: in one process with what it starts, and all of it ends together."""

import asyncio
import functools
import signal
import subprocess
from collections.abc import Callable, Coroutine, Iterator
from contextlib import contextmanager
from typing import Any, TypeVar
from unittest import mock

from prefect.exceptions import TerminationSignal
from prefect.server.api.server import SubprocessASGIServer

from flows.console import Interrupted, same_command
from flows.orphans import none_left
from flows.server import require_server
from flows.tracebacks import without_tracebacks

Outcome = TypeVar("Outcome")


def launch(flow: Callable[..., Coroutine[Any, Any, Outcome]], *given: Any) -> Outcome:
    """What a flow returns; what is the input's fault comes without a traceback.

    Raises:
        DeploymentFailed: the server that is named does not answer, or refuses us.
        Interrupted: Ctrl-C or SIGTERM; every stage that has ended is kept, a training in work has
            its last checkpoint, and no process is left.
    """
    without_tracebacks()
    require_server()
    for wish in (signal.SIGINT, signal.SIGTERM):  # a shell's `&` takes the first away
        signal.signal(wish, signal.default_int_handler)
    try:
        with none_left(), server_apart():
            return asyncio.run(flow(*given))
    except (KeyboardInterrupt, asyncio.CancelledError, TerminationSignal):
        raise Interrupted(f"resume: {same_command()}") from None


@contextmanager
def server_apart() -> Iterator[None]:
    """Prefect's temporary server is started in a session of its own.

    Ctrl-C in a terminal, and a kill of a process group, reach every process of the group: without
    its server a flow asks in vain for minutes before it ends. `none_left` and Prefect end it.
    """
    start = SubprocessASGIServer._run_uvicorn_command  # there is no public place
    apart = functools.partial(subprocess.Popen, start_new_session=True)

    def run(server: SubprocessASGIServer) -> "subprocess.Popen[Any]":
        with mock.patch("prefect.server.api.server.subprocess.Popen", apart):
            return start(server)

    with mock.patch.object(SubprocessASGIServer, "_run_uvicorn_command", run):
        yield
