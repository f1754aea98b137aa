"""Waiting for runs on workers: one question for all of them, and patience with the server."""

import asyncio
from typing import Any
from uuid import UUID, uuid4

import pytest
from prefect.client.schemas.objects import FlowRun
from prefect.states import Completed, Scheduled

from flows.study import run_watcher


def waiting(count: int) -> list[FlowRun]:
    return [FlowRun(id=uuid4(), flow_id=uuid4(), state=Scheduled()) for _ in range(count)]


class Server:
    """A server whose runs end one more a question, and that is away for the first ones."""

    def __init__(self, away: int = 0) -> None:
        self.away, self.calls = away, 0
        self.over: set[UUID] = set()

    async def __call__(self, ids: list[UUID]) -> list[FlowRun]:
        self.calls += 1
        if self.calls <= self.away:
            raise ConnectionError("no server")
        self.over.add(min(ids))
        return [FlowRun(id=i, flow_id=uuid4(), state=Completed()) for i in ids if i in self.over]


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> pytest.MonkeyPatch:
    monkeypatch.setattr(run_watcher, "EVERY_S", 0.01)
    return monkeypatch


def wait_for(runs: list[FlowRun], server: Any, patch: pytest.MonkeyPatch) -> list[FlowRun]:
    patch.setattr(run_watcher, "_ended", server)

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
