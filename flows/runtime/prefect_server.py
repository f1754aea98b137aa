"""Prefect's server as a command meets it: one line where it is not there or does not let us in."""

import time
from collections.abc import Iterator
from contextlib import contextmanager

from httpx import HTTPStatusError, TransportError
from prefect.client.orchestration import get_client
from prefect.exceptions import ObjectNotFound
from prefect.settings import PREFECT_API_URL

from robojackson.errors import DeploymentFailed

EVERY_S = 0.5
REFUSED = (401, 403)
"""HTTP codes with which a server refuses access."""
NOT_FOUND = 404


def require_server() -> None:
    """Check that a run may begin on the server that PREFECT_API_URL names, if it names one.

    Raises:
        DeploymentFailed: it does not answer, or refuses us.
    """
    if PREFECT_API_URL.value():
        with answering(), get_client(sync_client=True) as client:
            client.hello()


async def require_deployment(name: str) -> None:
    """Check that the server has a deployment, before work is done for its runs.

    Raises:
        DeploymentFailed: it does not have it, does not answer, or refuses us.
    """
    with answering():
        async with get_client() as client:
            try:
                await client.read_deployment_by_name(name)
            except ObjectNotFound as cause:
                raise DeploymentFailed(
                    f"{_named()} has no deployment {name}, whose runs workers take. Start a server "
                    "(`robojackson server`), set PREFECT_API_URL to its address, register with "
                    "`robojackson deploy`, then start a worker (`prefect worker start --pool "
                    "training`); `--executor local` needs none of them"
                ) from cause


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
    named = _named()
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
        if code == NOT_FOUND and (better := _with_api()):
            raise DeploymentFailed(
                f"{named} is no address of its API, which ends in /api: "
                f"set PREFECT_API_URL={better}"
            ) from cause
        raise DeploymentFailed(f"{named}: {cause}") from cause


def _named() -> str:
    return f"the Prefect server of PREFECT_API_URL={PREFECT_API_URL.value()}"


def _with_api() -> str:
    """Return the address of PREFECT_API_URL with the end that it lacks; empty where it has it."""
    address = str(PREFECT_API_URL.value()).rstrip("/")
    return "" if address.endswith("/api") else f"{address}/api"
