"""Laws of the end of a child process, of its group and of its parent."""

import asyncio
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from robojackson.cli.lifetime.asyncio_process import running
from robojackson.cli.lifetime.process_group import end_group, signal_group
from tests.fixtures.commands import environment

LEADER = """
import signal, subprocess, sys, time
signal.signal(signal.SIGTERM, getattr(signal, sys.argv[1]))
child = subprocess.Popen([sys.executable, "-S", "-c", "import time; time.sleep(60)"])
print(child.pid, flush=True)
time.sleep(60)
"""
ORPHAN = """
import os, sys, time
from robojackson.cli.lifetime import parent_death
parent_death.WATCH_S = 0.05
parent_death.watch_parent(int(sys.argv[1]))
print(os.getpid(), flush=True)
time.sleep(60)
"""
PARENT = f"""
import os, subprocess, sys
subprocess.run([sys.executable, "-c", {ORPHAN!r}, str(os.getpid())])
"""


def has_ended(pid: int) -> bool:
    """Return whether a process ends soon; one that waits to be reaped has ended."""
    until = time.monotonic() + 10
    while time.monotonic() < until:
        try:
            if Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] == "Z":
                return True
        except (FileNotFoundError, ProcessLookupError):
            return True
        time.sleep(0.02)
    return False


def started(*words: str) -> tuple[subprocess.Popen[bytes], int]:
    """Start the leader of a group; return it and the number that it prints."""
    process = subprocess.Popen(
        [sys.executable, "-c", *words],
        stdout=subprocess.PIPE,
        start_new_session=True,
        env=environment(),
    )
    assert process.stdout is not None
    return process, int(process.stdout.readline())


@pytest.mark.parametrize(
    ("answer", "code"), [("SIG_DFL", -signal.SIGTERM), ("SIG_IGN", -signal.SIGKILL)]
)
def test_a_group_gets_a_signal_first_and_is_then_killed(answer: str, code: int) -> None:
    leader, child = started(LEADER, answer)
    with leader:
        end_group(leader, grace_s=5.0 if answer == "SIG_DFL" else 0.2)
        assert leader.returncode == code
    assert has_ended(child)


def test_a_group_that_has_ended_takes_no_signal() -> None:
    with subprocess.Popen([sys.executable, "-S", "-c", ""], start_new_session=True) as process:
        process.wait()
        end_group(process, grace_s=0.0)
        signal_group(process.pid, signal.SIGKILL)
    assert process.returncode == 0


@pytest.mark.parametrize("answer", ["SIG_DFL", "SIG_IGN"])
def test_an_error_in_the_event_loop_leaves_no_process(answer: str) -> None:
    pids: list[int] = []

    async def fail() -> None:
        command = [sys.executable, "-c", LEADER, answer]
        async with running(command, dict(os.environ), grace_s=0.2) as process:
            assert process.stdout is not None
            pids.extend((process.pid, int(await process.stdout.readline())))
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        asyncio.run(fail())
    assert all(has_ended(pid) for pid in pids)


def test_a_process_that_watches_its_parent_ends_after_it() -> None:
    parent, orphan = started(PARENT)
    with parent:
        parent.kill()
    assert has_ended(orphan)
