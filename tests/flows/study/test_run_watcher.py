"""Waiting for runs on workers: one question for all of them, and patience with the server."""

import asyncio
from typing import Any
from unittest.mock import AsyncMock
from uuid import UUID, uuid4

import pytest
from prefect import flow
from prefect.client.orchestration import get_client
from prefect.client.schemas.filters import FlowRunFilter
from prefect.client.schemas.objects import FlowRun
from prefect.states import Completed, Pending, Running, Scheduled

from flows.study import run_watcher
from robojackson.errors import TrainingCrashed


def waiting(count: int) -> list[FlowRun]:
    return [FlowRun(id=uuid4(), flow_id=uuid4(), state=Scheduled()) for _ in range(count)]


class Server:
    """A server whose runs end one more a question, and that is away for the first ones.

    Runs that were deleted are neither over nor there.
    """

    def __init__(self, away: int = 0, deleted: frozenset[UUID] = frozenset()) -> None:
        self.away, self.calls = away, 0
        self.deleted = deleted
        self.over: set[UUID] = set()

    async def __call__(self, ids: list[UUID]) -> list[FlowRun]:
        self.calls += 1
        if self.calls <= self.away:
            raise ConnectionError("no server")
        self.over.add(min(ids))
        self.over -= self.deleted
        return [FlowRun(id=i, flow_id=uuid4(), state=Completed()) for i in ids if i in self.over]

    async def existing(self, ids: list[UUID]) -> set[UUID]:
        return set(ids) - self.deleted


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> pytest.MonkeyPatch:
    monkeypatch.setattr(run_watcher, "EVERY_S", 0.01)
    return monkeypatch


def wait_for(runs: list[FlowRun], server: Server, patch: pytest.MonkeyPatch) -> list[FlowRun]:
    patch.setattr(run_watcher, "_ended", server)
    patch.setattr(run_watcher, "_existing", server.existing)

    async def all_of() -> list[FlowRun]:
        ended = run_watcher.RunWatcher()
        return list(await asyncio.gather(*(ended.of(run) for run in runs)))

    return asyncio.run(asyncio.wait_for(all_of(), 20))


def test_every_run_comes_back_as_itself(quick: pytest.MonkeyPatch) -> None:
    runs = waiting(5)
    ended = wait_for(runs, Server(), quick)
    assert [run.id for run in ended] == [run.id for run in runs]
    assert all(run.state is not None and run.state.is_completed() for run in ended)


def test_all_runs_together_are_requested_once_a_look(quick: pytest.MonkeyPatch) -> None:
    server = Server()
    wait_for(waiting(5), server, quick)
    assert server.calls == 5  # one more ends a look: not five questions a look


def test_a_run_that_has_ended_is_not_requested(quick: pytest.MonkeyPatch) -> None:
    server = Server()
    wait_for([FlowRun(id=uuid4(), flow_id=uuid4(), state=Completed())], server, quick)
    assert server.calls == 0


def test_a_server_that_is_away_for_a_while_loses_no_run(quick: pytest.MonkeyPatch) -> None:
    assert len(wait_for(waiting(2), Server(away=3), quick)) == 2


def test_a_server_that_stays_away_is_an_error(quick: pytest.MonkeyPatch) -> None:
    quick.setattr(run_watcher, "PATIENCE_S", 0.05)
    with pytest.raises(ConnectionError, match="no server"):
        wait_for(waiting(2), Server(away=10**6), quick)


def test_a_run_that_was_deleted_fails_and_the_others_end(quick: pytest.MonkeyPatch) -> None:
    quick.setattr(run_watcher, "LOOKS", 2)
    runs = waiting(3)
    gone, server = runs[1].id, Server(deleted=frozenset([runs[1].id]))

    async def each() -> list[FlowRun | BaseException]:
        watcher = run_watcher.RunWatcher()
        return await asyncio.gather(*map(watcher.of, runs), return_exceptions=True)

    quick.setattr(run_watcher, "_ended", server)
    quick.setattr(run_watcher, "_existing", server.existing)
    first, second, third = asyncio.run(asyncio.wait_for(each(), 20))
    assert [getattr(run, "id", None) for run in (first, third)] == [runs[0].id, runs[2].id]
    assert isinstance(second, TrainingCrashed)
    assert str(second) == f"the run {gone} was deleted from the Prefect server"


def test_runs_are_looked_up_two_hundred_at_a_time(quick: pytest.MonkeyPatch) -> None:
    """The server returns no more, and one that it left out would count as deleted."""
    ids, requests = [run.id for run in waiting(450)], []

    class Client:
        async def __aenter__(self) -> "Client":
            return self

        async def __aexit__(self, *error: object) -> None:
            pass

        async def read_flow_runs(self, flow_run_filter: FlowRunFilter, limit: int) -> list[FlowRun]:
            assert flow_run_filter.state is None
            requests.append((len(flow_run_filter.id.any_), limit))
            return [FlowRun(id=i, flow_id=uuid4()) for i in flow_run_filter.id.any_]

    quick.setattr(run_watcher, "get_client", Client)
    assert asyncio.run(run_watcher._existing(ids)) == set(ids)
    assert requests == [(200, 200), (200, 200), (50, 200)]


def test_runs_that_are_cancelled_together_are_one_request(quick: pytest.MonkeyPatch) -> None:
    """An interrupted command has a second or two."""
    runs, requests = waiting(5), []

    async def cancelled(ids: list[UUID]) -> None:
        requests.append(set(ids))

    async def interrupted() -> None:
        watcher = run_watcher.RunWatcher()
        together = asyncio.gather(*map(watcher.of, runs), return_exceptions=True)
        await asyncio.sleep(0.01)
        together.cancel()
        await together

    quick.setattr(run_watcher, "_cancel_waiting", cancelled)
    with pytest.raises(asyncio.CancelledError):
        asyncio.run(interrupted())
    assert requests == [{run.id for run in runs}]


def test_a_server_that_is_away_does_not_keep_a_cancelled_study(
    quick: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    quick.setattr(run_watcher, "_cancel_waiting", AsyncMock(side_effect=ConnectionError("away")))
    asyncio.run(run_watcher.RunWatcher().cancel(uuid4()))
    assert "1 runs on workers cannot be cancelled: away" in caplog.text


@pytest.mark.medium
@pytest.mark.parametrize(
    ("state", "expected"), [(Scheduled, "CANCELLED"), (Pending, "CANCELLING"), (Running, "RUNNING")]
)
def test_a_run_is_cancelled_unless_a_worker_has_begun_it(
    state: Any, expected: str, prefect_server: None
) -> None:
    async def cancelled() -> str:
        async with get_client() as client:
            run = await client.create_flow_run(flow(lambda: None, name="nothing"), state=state())
            await run_watcher.RunWatcher().cancel(run.id)
            ended = await client.read_flow_run(run.id)
            assert ended.state is not None
            return ended.state.type.value

    assert asyncio.run(cancelled()) == expected


@pytest.mark.medium
def test_a_server_has_a_run_until_it_is_deleted(prefect_server: None) -> None:
    async def look() -> tuple[set[UUID], set[UUID]]:
        async with get_client() as client:
            run = await client.create_flow_run(flow(lambda: None, name="nothing"))
            before = await run_watcher._existing([run.id])
            await client.delete_flow_run(run.id)
            return before ^ {run.id}, await run_watcher._existing([run.id])

    assert asyncio.run(look()) == (set(), set())
