"""The tools of chaos: a wire that is cut, processes that are found, kinds that take turns."""

import os
import random
import signal
import socketserver
import subprocess
import sys
import threading
from collections import Counter
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from urllib.error import URLError
from urllib.request import urlopen

import pytest

from tests.chaos.cut_wire import Proxy
from tests.chaos.run import plan
from tests.chaos.trial import Trial
from tools.stack.processes import Found, cpu_seconds, under
from tools.stack.service import Service

ANSWER = b"HTTP/1.0 200 OK\r\nContent-Length: 5\r\n\r\nhello"


class Hello(socketserver.BaseRequestHandler):
    def handle(self) -> None:
        self.request.recv(1024)
        self.request.sendall(ANSWER)


@pytest.fixture
def wire() -> Iterator[Proxy]:
    """Yield a wire to a server that answers `hello`."""
    with socketserver.ThreadingTCPServer(("127.0.0.1", 0), Hello) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        proxy = Proxy(server.server_address[1])
        yield proxy
        proxy.close()
        server.shutdown()


def answer_of(wire: Proxy) -> bytes:
    with urlopen(f"http://127.0.0.1:{wire.port}/", timeout=5) as answer:
        return bytes(answer.read())


def test_a_wire_forwards(wire: Proxy) -> None:
    assert answer_of(wire) == b"hello"


def test_a_cut_wire_answers_no_one(wire: Proxy) -> None:
    wire.cut()
    with pytest.raises((URLError, ConnectionError)):
        answer_of(wire)


def test_a_cut_wire_counts_who_needed_it(wire: Proxy) -> None:
    answer_of(wire)
    before = wire.refused
    wire.cut()
    with suppress(URLError, ConnectionError):
        answer_of(wire)
    assert (before, wire.refused) == (0, 1)


def test_a_mended_wire_forwards_again(wire: Proxy) -> None:
    wire.cut()
    wire.mend()
    assert answer_of(wire) == b"hello"


def test_processes_are_found_by_their_home_and_killed(tmp_path: Path) -> None:
    command = [sys.executable, "-c", "print(flush=True); import time; time.sleep(60)"]
    environment = {**os.environ, "HOME": str(tmp_path / "home" / "worker")}
    with subprocess.Popen(command, env=environment, stdout=subprocess.PIPE) as process:
        assert process.stdout is not None
        process.stdout.readline()
        (found,) = under(tmp_path / "home")
        assert (found.pid, "time.sleep(60)" in found.command) == (process.pid, True)
        assert found.kill()
        assert process.wait() == -signal.SIGKILL
    assert under(tmp_path / "home") == []


@pytest.mark.medium
def test_a_process_that_has_ended_is_not_hit(tmp_path: Path) -> None:
    with subprocess.Popen([sys.executable, "-S", "-c", ""]) as process:
        dead = Found(process.pid, "", tmp_path)
        os.waitid(os.P_PID, process.pid, os.WEXITED | os.WNOWAIT)
        assert not dead.kill()


@pytest.mark.parametrize(("script", "hit"), [("import time; time.sleep(60)", True), ("", False)])
def test_a_service_is_hit_only_while_it_lives(script: str, hit: bool, tmp_path: Path) -> None:
    command = [sys.executable, "-S", "-c", script]
    service = Service("s", command, dict(os.environ), None, tmp_path / "log")
    service.start()
    assert service.process is not None
    if not hit:
        service.process.wait()
    assert service.murder() == hit


def test_processor_time_counts_children_that_have_ended() -> None:
    before = cpu_seconds(os.getpid())
    burn = "import time\nwhile time.process_time() < 0.3: pass"
    subprocess.run([sys.executable, "-S", "-c", burn], check=True)
    assert 0.25 < cpu_seconds(os.getpid()) - before < 3.0


def test_kinds_take_turns_in_random_order() -> None:
    drawn = plan(["a", "b", "c"], 7, random.Random(0))
    assert sorted(Counter(drawn).values()) == [2, 2, 3]
    assert drawn != plan(["a", "b", "c"], 7, random.Random(2))


GOOD = {"hit": "it", "first": "FAILED", "again": "COMPLETED", "equal": True}


@pytest.mark.parametrize(
    "wrong", [{}, {"hit": ""}, {"again": "FAILED"}, {"equal": False}, {"left": ["x"]}], ids=str
)
def test_a_trial_is_good_only_if_nothing_is_wrong(wrong: dict[str, object]) -> None:
    trial = Trial(1, "cell", 5.0, **{**GOOD, **wrong})  # type: ignore[arg-type]
    assert trial.good == (not wrong)
