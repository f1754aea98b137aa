"""The processes of a service are distinguished from those that it has started."""

import os
import subprocess
import sys
import time
from collections.abc import Iterator

import pytest

from tools.stack.processes import forks

FORKS = "import os, time; child = os.fork(); child and print(child, flush=True); time.sleep(60)"
STARTS = (
    "import subprocess, sys, time; other = [sys.executable, '-c', 'import time; time.sleep(60)'];"
    "print(subprocess.Popen(other).pid, flush=True); time.sleep(60)"
)


@pytest.fixture
def started(request: pytest.FixtureRequest) -> Iterator[tuple[int, int]]:
    """Yield the ids of a process and of its child."""
    command = [sys.executable, "-c", request.param]
    with subprocess.Popen(command, stdout=subprocess.PIPE, start_new_session=True) as process:
        assert process.stdout is not None
        child = int(process.stdout.readline())
        time.sleep(0.3)  # the child of a new program is a copy of its parent for a moment
        yield process.pid, child
        os.killpg(process.pid, 9)


@pytest.mark.parametrize("started", [FORKS], indirect=True)
def test_a_fork_is_part_of_its_service(started: tuple[int, int]) -> None:
    assert forks(started[0]) == {started[1]}


@pytest.mark.parametrize("started", [STARTS], indirect=True)
def test_another_program_is_not(started: tuple[int, int]) -> None:
    assert forks(started[0]) == set()
