"""What a flow has started ends with it, however it ends."""

import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from robojackson.cli.lifetime.orphans import VARIABLE, end_all
from tests.fixtures.commands import environment

FLOW = """
import subprocess, sys, time
from robojackson.cli.lifetime.orphans import none_left
with none_left():
    child = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(60)"])
    time.sleep(float(sys.argv[1]))
print(child.pid, child.poll(), flush=True)
child.kill()
"""


def children_of(pid: int) -> list[int]:
    path = Path(f"/proc/{pid}/task/{pid}/children")
    return [int(word) for word in path.read_text().split()] if path.exists() else []


def is_alive(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except (FileNotFoundError, ProcessLookupError):
        return False


@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGTERM])
def test_a_killed_flow_leaves_no_process(how: signal.Signals) -> None:
    with subprocess.Popen([sys.executable, "-c", FLOW, "60"], env=environment()) as flow:
        while len(started := children_of(flow.pid)) < 2:
            time.sleep(0.02)
        flow.send_signal(how)
    until = time.monotonic() + 10
    while any(map(is_alive, started)) and time.monotonic() < until:
        time.sleep(0.05)
    assert [pid for pid in started if is_alive(pid)] == []


def test_a_process_that_does_not_listen_is_killed() -> None:
    deaf = (
        "import signal, time; signal.signal(15, signal.SIG_IGN); print(flush=True); time.sleep(60)"
    )
    given = environment(**{VARIABLE: "deaf"})
    with subprocess.Popen([sys.executable, "-c", deaf], env=given, stdout=subprocess.PIPE) as child:
        assert child.stdout
        child.stdout.readline()
        end_all("deaf", grace_s=0.2)
        assert child.wait(5) == -signal.SIGKILL


def test_a_flow_that_ends_well_ends_no_one() -> None:
    command = [sys.executable, "-c", FLOW, "0"]
    done = subprocess.run(command, capture_output=True, text=True, env=environment(), check=True)
    assert done.stdout.split()[1] == "None"
