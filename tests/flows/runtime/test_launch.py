"""The end of a flow from the command line: interrupted, or after the death of its server."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import httpx
import pytest

from flows.runtime import launch
from robojackson.errors import DeploymentFailed
from tests.fixtures.commands import without_server
from tools.stack.interrupted_command import living_with

pytestmark = pytest.mark.xdist_group("launch")

FLOW = """
import asyncio, sys, typer
from flows.runtime.environment import prepare
from flows.runtime.temporary_server import temporary_server
from robojackson.cli.lifetime.supervisor import guarded
from storage.store import Store
from robojackson.cli.console import CommandResult, command

@command
def start(as_json=False):
    prepare(Store.from_environment())
    with temporary_server():
        from prefect import flow
        from flows.runtime.launch import launch

        @flow
        async def long():
            print("under way", flush=True)
            await asyncio.sleep(600)

        return CommandResult(launch(long))

app = typer.Typer()
app.command()(start)
sys.exit(guarded(lambda: app(standalone_mode=False)))
"""
ENDED_S = 10.0
"""A generous multiple of 3 s, for a busy machine."""


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a store whose database the first server makes."""
    return tmp_path_factory.mktemp("launch") / "store"


@pytest.mark.slow
@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("send", [os.kill, os.killpg])
def test_an_interrupted_flow_ends_at_once_and_says_how_to_resume(
    send: Callable[[int, int], None], how: signal.Signals, store: Path, tmp_path: Path
) -> None:
    script = tmp_path / "long.py"
    script.write_text(FLOW)
    with subprocess.Popen(
        [sys.executable, str(script)],
        stderr=subprocess.PIPE,
        text=True,
        env=without_server(ROBOJACKSON_STORE=str(store)),
        start_new_session=True,
    ) as process:
        assert process.stderr is not None
        for line in process.stderr:
            if "under way" in line:
                break
        began = time.monotonic()
        send(process.pid, how)
        rest = process.stderr.read()
    assert process.returncode == 130
    assert rest.splitlines() == [
        "robojackson: interrupted, ending ...",
        "robojackson: interrupted: resume: robojackson",
    ]
    assert time.monotonic() - began < ENDED_S
    assert living_with(f"ROBOJACKSON_STORE={store}") == {}


def test_a_server_that_dies_during_a_run_is_one_line_with_the_next_step(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    async def lost() -> None:
        raise httpx.ConnectError("All connection attempts failed")

    monkeypatch.delenv("PREFECT_API_URL", raising=False)
    monkeypatch.setattr(launch, "same_command", lambda: "robojackson dance a.mp4")
    with pytest.raises(
        DeploymentFailed, match=r"server of this run .*\(All connection attempts"
    ) as caught:
        launch.launch(lost)
    assert str(caught.value).endswith("finished stages are kept; resume: robojackson dance a.mp4")
