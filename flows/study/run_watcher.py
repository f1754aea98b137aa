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
from prefect.client.schemas.objects import TERMINAL_STATES, FlowRun, StateType
from prefect.states import Cancelling

from robojackson.errors import TrainingCrashed

EVERY_S = 2.0
"""Between two questions, seconds."""
PATIENCE_S = 600.0
"""How long the server may be away before the runs are given up, seconds."""
LOOKS = 15
"""After so many questions, one whether the server still has the runs: one that was deleted never
ends."""
MOST = 200
"""Runs that the server returns at a time."""
WAITING = (StateType.SCHEDULED, StateType.PENDING)
"""States of a run that no worker has begun; the server cancels it at once where none took it."""
CANCELLED = "the study that waited for it was cancelled"
log = logging.getLogger(__name__)


class RunWatcher:
    """The runs that are waited for."""

    def __init__(self) -> None:
        self._waiting: dict[UUID, asyncio.Future[FlowRun]] = {}
        self._asking: asyncio.Task[None] | None = None

    async def of(self, run: FlowRun) -> FlowRun:
        """Return the run as it ended.

        Raises:
            TrainingCrashed: the run was deleted.
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
        looks = 0
        while self._waiting:
            await asyncio.sleep(EVERY_S)
            looks += 1
            try:
                found = await _ended(list(self._waiting))
                if looks % LOOKS == 0:
                    await self._fail_deleted()
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

    async def _fail_deleted(self) -> None:
        waiting = list(self._waiting)
        for run_id in set(waiting) - await _existing(waiting):
            waits = self._waiting.get(run_id)
            if waits is not None and not waits.done():
                waits.set_exception(
                    TrainingCrashed(f"the run {run_id} was deleted from the Prefect server")
                )

    def _give_up(self, cause: Exception) -> None:
        for waits in self._waiting.values():
            if not waits.done():
                waits.set_exception(cause)


async def cancel_waiting(run_id: UUID) -> None:
    """Cancel a run that no worker has begun; one that is begun goes on.

    A server that does not answer is logged: its run stays in the queue.
    """
    try:
        async with get_client() as client:
            run = await client.read_flow_run(run_id)
            if run.state is not None and run.state.type in WAITING:
                await client.set_flow_run_state(run_id, Cancelling(message=CANCELLED))
    except Exception as cause:
        log.warning("the run %s on a worker cannot be cancelled: %s", run_id, cause)


async def _ended(waiting: list[UUID]) -> list[FlowRun]:
    """Return runs that have ended, `MOST` at a time."""
    over = FlowRunFilterStateType(any_=sorted(TERMINAL_STATES))
    criteria = FlowRunFilter(id=FlowRunFilterId(any_=waiting), state=FlowRunFilterState(type=over))
    async with get_client() as client:
        return await client.read_flow_runs(flow_run_filter=criteria)


async def _existing(waiting: list[UUID]) -> set[UUID]:
    """Return those runs that the server has, in any state."""
    found: set[UUID] = set()
    async with get_client() as client:
        for start in range(0, len(waiting), MOST):
            some = FlowRunFilterId(any_=waiting[start : start + MOST])
            runs = await client.read_flow_runs(flow_run_filter=FlowRunFilter(id=some), limit=MOST)
            found |= {run.id for run in runs}
    return found
