"""Prefect's server as a command meets it: one line where it is not there or does not let us in."""

import time
from collections.abc import Iterator
from contextlib import contextmanager

from httpx import HTTPStatusError, TransportError
from prefect.client.orchestration import get_client
from prefect.settings import PREFECT_API_URL

from robojackson.errors import DeploymentFailed

EVERY_S = 0.5
REFUSED = (401, 403)
"""HTTP codes with which a server refuses access."""


def require_server() -> None:
    """Check that a run may begin on the server that PREFECT_API_URL names, if it names one.

    Raises:
        DeploymentFailed: it does not answer, or refuses us.
    """
    if PREFECT_API_URL.value():
        with answering(), get_client(sync_client=True) as client:
            client.hello()


def await_server(seconds: float) -> None:
    """Return when the server of PREFECT_API_URL answers; one that was just started takes a while.

    Args:
        seconds: How long it may take.
    Raises:
        DeploymentFailed: it does not answer in that time, or refuses us.
    """
    end = time.monotonic() + seconds
    while True:
        try:
            return require_server()
        except DeploymentFailed as cause:
            if not isinstance(cause.__cause__, TransportError) or time.monotonic() >= end:
                raise
        time.sleep(EVERY_S)


@contextmanager
def answering() -> Iterator[None]:
    """Turn failures of a server into one line with the next step.

    Raises:
        DeploymentFailed: it does not answer, or refuses access or a request.
    """
    named = f"the Prefect server of PREFECT_API_URL={PREFECT_API_URL.value()}"
    try:
        yield
    except TransportError as cause:
        reason = str(cause) or type(cause).__name__
        raise DeploymentFailed(
            f"{named} does not answer ({reason}); start it (`robojackson server`) or correct "
            "the address; where it is not set, flows start a server of their own"
        ) from cause
    except HTTPStatusError as cause:
        code = cause.response.status_code
        if code in REFUSED:
            raise DeploymentFailed(
                f"{named} refuses us ({code} {cause.response.reason_phrase}); "
                "set PREFECT_API_AUTH_STRING to its user:password"
            ) from cause
        raise DeploymentFailed(f"{named}: {cause}") from cause
