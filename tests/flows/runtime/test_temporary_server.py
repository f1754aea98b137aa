"""The server of a command: one where none is named, and one line where it does not start."""

import subprocess
import sys
import time
from pathlib import Path

import pytest
from prefect.settings import (
    PREFECT_API_URL,
    PREFECT_SERVER_EPHEMERAL_ENABLED,
    PREFECT_UI_URL,
    temporary_settings,
)

from flows.runtime import temporary_server as temporary_server_module
from flows.runtime.server_process import reason
from flows.runtime.temporary_server import temporary_server
from tests.fixtures.commands import without_server

COMMAND = """
import sys
from flows.runtime.environment import prepare
from flows.runtime.temporary_server import temporary_server
from storage.store import Store

prepare(Store.from_environment())
with temporary_server():
    from prefect import flow, get_client
    from flows.runtime.launch import launch

    @flow
    async def counted():
        async with get_client() as client:
            print(len(await client.read_flow_runs()), client.api_url)

    launch(counted)
"""


def run(store: Path) -> "subprocess.CompletedProcess[str]":
    outer = without_server(ROBOJACKSON_STORE=str(store))
    return subprocess.run(
        [sys.executable, "-c", COMMAND], capture_output=True, text=True, env=outer, check=False
    )


@pytest.mark.slow
@pytest.mark.xdist_group("launch")
def test_a_flow_runs_on_a_server_of_its_own_that_keeps_its_records(tmp_path: Path) -> None:
    done = run(tmp_path)
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("1 http://127.0.0.1:")
    assert "View at" not in done.stderr  # it has no pages
    assert (tmp_path / "prefect" / "prefect.db").is_file()


@pytest.mark.slow
@pytest.mark.xdist_group("launch")
def test_a_damaged_database_is_one_line_that_says_where_it_is(tmp_path: Path) -> None:
    home = tmp_path / "prefect"
    home.mkdir()
    (home / "prefect.db").write_text("no database of SQLite, and longer than its header")
    done = run(tmp_path)
    assert done.returncode == 1
    assert "Application startup failed" not in done.stderr
    last = done.stderr.splitlines()[-1]
    assert "the temporary Prefect server does not start: sqlalchemy.exc.DatabaseError" in last
    assert f"prefect.db* in {home}" in last


def test_the_reason_is_read_while_the_process_still_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    """On a busy machine the socket is closed some time before the process is over."""
    written = "import os, sys, time; os.write(int(sys.argv[2]), b'no disk'); time.sleep(60)"
    begin = subprocess.Popen

    def begun(command: list[str], pass_fds: tuple[int, int]) -> "subprocess.Popen[bytes]":
        line = [command[0], "-c", written, *command[-2:]]
        return begin(line, pass_fds=pass_fds)

    monkeypatch.setattr(subprocess, "Popen", begun)
    server = temporary_server_module._Server()
    try:
        ends = time.monotonic() + 30.0
        while not (found := server.reason()) and time.monotonic() < ends:
            time.sleep(0.02)
        assert found == "no disk"
        assert server._process.poll() is None
        assert server.reason() == ""
    finally:
        server._process.kill()


def test_a_named_server_is_used(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(subprocess, "Popen", None)
    named = {PREFECT_API_URL: "http://127.0.0.1:9/api", PREFECT_UI_URL: "http://127.0.0.1:9"}
    with temporary_settings(named), temporary_server():
        assert PREFECT_API_URL.value() == named[PREFECT_API_URL]
        assert PREFECT_UI_URL.value() == named[PREFECT_UI_URL]


def test_none_is_started_where_none_is_allowed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(subprocess, "Popen", None)
    settings = {PREFECT_SERVER_EPHEMERAL_ENABLED: False}
    with (
        temporary_settings(settings, restore_defaults={PREFECT_API_URL}),
        temporary_server(),
    ):
        assert PREFECT_API_URL.value() is None


def test_the_reason_is_the_line_that_names_the_exception() -> None:
    text = (
        "Traceback (most recent call last):\n  File\n    x\nan.Error: what\n(Background on this)\n"
    )
    assert reason(text) == "an.Error: what"
    assert reason("Application startup failed. Exiting.") == ""
