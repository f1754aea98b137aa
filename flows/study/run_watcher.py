"""Waiting for many runs at once: one question to the server, however many runs there are.

Prefect's own `run_deployment` polls each of its runs every 5 s: a thousand that wait would be
200 calls a second, more than one server answers.
"""

import asyncio
import logging
import time
from typing import Any
from uuid import UUID

from prefect.client.orchestration import get_client
from prefect.client.schemas.filters import (
    FlowRunFilter,
    FlowRunFilterId,
    FlowRunFilterState,
    FlowRunFilterStateType,
)
from prefect.client.schemas.objects import TERMINAL_STATES, FlowRun, StateType

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
BULK: Any = "/flow_runs/bulk_set_state"
"""Route that Prefect's client does not list."""
MOST_CANCELLED = 50
"""Runs that it cancels at a time."""
WAITING = (StateType.SCHEDULED, StateType.PENDING)
"""States of a run that no worker has begun; the server cancels it at once where none took it."""
CANCELLED = "the study that waited for it was cancelled"
log = logging.getLogger(__name__)


class RunWatcher:
    """The runs that are waited for."""

    def __init__(self) -> None:
        self._waiting: dict[UUID, asyncio.Future[FlowRun]] = {}
        self._asking: asyncio.Task[None] | None = None
        self._cancelled: set[UUID] = set()
        self._cancelling: asyncio.Task[None] | None = None

    async def of(self, run: FlowRun) -> FlowRun:
        """Return the run as it ended.

        Raises:
            CancelledError: its study is cancelled, and the run as by `cancel`.
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
        except asyncio.CancelledError:
            await self.cancel(run.id)
            raise
        finally:
            del self._waiting[run.id]

    async def cancel(self, run_id: UUID) -> None:
        """Cancel a run, if no worker has begun it, together with others that are cancelled now.

        A server that does not answer is logged: the run stays in its queue.
        """
        self._cancelled.add(run_id)
        if self._cancelling is None or self._cancelling.done():
            self._cancelling = asyncio.create_task(self._cancel())
        await asyncio.shield(self._cancelling)

    async def _cancel(self) -> None:
        await asyncio.sleep(0)  # for the others
        while self._cancelled:
            runs = list(self._cancelled)
            self._cancelled.clear()
            try:
                await _cancel_waiting(runs)
            except Exception as cause:
                log.warning("%d runs on workers cannot be cancelled: %s", len(runs), cause)

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


async def _cancel_waiting(runs: list[UUID]) -> None:
    """Cancel those runs that no worker has begun, all at once: a process that is interrupted has
    little time."""
    state = {"type": "CANCELLING", "name": "Cancelling", "message": CANCELLED}
    async with get_client() as client:
        parts = [
            runs[start : start + MOST_CANCELLED] for start in range(0, len(runs), MOST_CANCELLED)
        ]
        bodies = [{"flow_runs": _begun_by_none(part), "state": state} for part in parts]
        await asyncio.gather(*(client.request("POST", BULK, json=body) for body in bodies))


def _begun_by_none(runs: list[UUID]) -> dict[str, Any]:
    """Return the filter of those runs that no worker has begun."""
    waiting = FlowRunFilterState(type=FlowRunFilterStateType(any_=list(WAITING)))
    criteria = FlowRunFilter(id=FlowRunFilterId(any_=runs), state=waiting)
    return criteria.model_dump(mode="json", exclude_unset=True)


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
