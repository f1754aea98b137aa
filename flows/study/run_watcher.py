"""Waiting for many runs at once: one question to the server, however many runs there are.

Prefect's own `run_deployment` polls each of its runs every 5 s: a thousand that wait would be
200 calls a second, more than one server answers.
"""

import asyncio
import logging
import time
from uuid import UUID

from prefect.client.orchestration import get_client
from prefect.client.schemas.filters import (
    FlowRunFilter,
    FlowRunFilterId,
    FlowRunFilterState,
    FlowRunFilterStateType,
)
from prefect.client.schemas.objects import TERMINAL_STATES, FlowRun

EVERY_S = 2.0
"""Between two questions, seconds."""
PATIENCE_S = 600.0
"""How long the server may be away before the runs are given up, seconds."""
log = logging.getLogger(__name__)


class RunWatcher:
    """The runs that are waited for."""

    def __init__(self) -> None:
        self._waiting: dict[UUID, asyncio.Future[FlowRun]] = {}
        self._asking: asyncio.Task[None] | None = None

    async def of(self, run: FlowRun) -> FlowRun:
        """Return the run as it ended.

        Raises:
            Exception: the server does not answer any more.
        """
        if run.state is not None and run.state.is_final():
            return run
        ended = self._waiting[run.id] = asyncio.get_running_loop().create_future()
        if self._asking is None or self._asking.done():
            self._asking = asyncio.create_task(self._poll())
        try:
            last: FlowRun = await ended
            return last
        finally:
            del self._waiting[run.id]

    async def _poll(self) -> None:
        """Poll until no run is waited for; a server that is away for a while is polled again."""
        answered = time.monotonic()
        while self._waiting:
            await asyncio.sleep(EVERY_S)
            try:
                found = await _ended(list(self._waiting))
                answered = time.monotonic()
            except Exception as cause:
                if time.monotonic() - answered > PATIENCE_S:
                    self._give_up(cause)
                    return
                log.warning("the runs on workers cannot be polled, will try again: %s", cause)
                continue
            for run in found:
                waits = self._waiting.get(run.id)
                if waits is not None and not waits.done():
                    waits.set_result(run)

    def _give_up(self, cause: Exception) -> None:
        for waits in self._waiting.values():
            if not waits.done():
                waits.set_exception(cause)


async def _ended(waiting: list[UUID]) -> list[FlowRun]:
    """Return the runs that have ended; the server returns at most 200 at a time."""
    over = FlowRunFilterStateType(any_=sorted(TERMINAL_STATES))
    criteria = FlowRunFilter(id=FlowRunFilterId(any_=waiting), state=FlowRunFilterState(type=over))
    async with get_client() as client:
        return await client.read_flow_runs(flow_run_filter=criteria)
