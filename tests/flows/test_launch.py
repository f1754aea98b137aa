"""A flow that is started from the command line ends in a moment, whoever else is told to end."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests.flows.conftest import environment

FLOW = """
import asyncio, typer
from flows.environment import prepare
from storage.store import Store
prepare(Store.from_environment())
from prefect import flow
from flows.console import Answer, command
from flows.launch import launch

@flow
async def long():
    print("under way", flush=True)
    await asyncio.sleep(600)

@command
def start(as_json=False):
    return Answer(launch(long))

typer.run(start)
"""


@pytest.mark.parametrize("wish", [signal.SIGINT, signal.SIGTERM])
def test_a_whole_group_that_is_told_to_end_does_so_at_once(
    wish: signal.Signals, tmp_path: Path
) -> None:
    script = tmp_path / "long.py"
    script.write_text(FLOW)
    with subprocess.Popen(
        [sys.executable, str(script)],
        stderr=subprocess.PIPE,
        text=True,
        env=environment() | {"ROBOJACKSON_STORE": str(tmp_path / "store")},
        start_new_session=True,
    ) as process:
        assert process.stderr is not None
        for line in process.stderr:
            if "under way" in line:
                break
        began = time.monotonic()
        os.killpg(process.pid, wish)
        rest = process.stderr.read()
    assert process.returncode == 130
    assert rest.count("interrupted: resume: robojackson") == 1
    assert "Traceback" not in rest
    assert time.monotonic() - began < 60
