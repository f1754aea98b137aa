"""A flow from the command line, and its end when it is interrupted."""

import asyncio
from collections.abc import Callable, Coroutine
from typing import Any, TypeVar

from httpx import TransportError
from prefect.exceptions import TerminationSignal

from flows.runtime.prefect_server import require_server
from flows.runtime.tracebacks import without_tracebacks
from robojackson.cli.console import Interrupted, same_command
from robojackson.cli.lifetime.orphans import none_left
from robojackson.errors import DeploymentFailed

Outcome = TypeVar("Outcome")


def launch(flow: Callable[..., Coroutine[Any, Any, Outcome]], *given: Any) -> Outcome:
    """Return what a flow returns; a fault of the input comes without a traceback.

    Raises:
        DeploymentFailed: the server that is named does not answer, or refuses us; or the run's
            server has died.
        Interrupted: Ctrl-C or SIGTERM; every stage that has ended is cached, a training in work has
            its last checkpoint, and `interruption` leaves no process.
    """
    without_tracebacks()
    require_server()
    try:
        with none_left():
            return asyncio.run(flow(*given))
    except (KeyboardInterrupt, asyncio.CancelledError, TerminationSignal):
        raise Interrupted(f"resume: {same_command()}") from None
    except TransportError as cause:
        raise DeploymentFailed(
            f"the Prefect server of this run has ended or does not answer any more ({cause}); "
            f"finished stages are kept; resume: {same_command()}"
        ) from cause
