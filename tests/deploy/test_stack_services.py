"""Services of the stack as processes: ports, restarts, and the error of one that ended."""

import os
import sys
from pathlib import Path

import pytest

from tools.stack.service import LISTENING, Service, StackError, free_port


def service(tmp_path: Path, code: str, restarts: int = 0) -> Service:
    """Return a service of our Python whose health check asks for the file `healthy`."""
    check = ["test", "-e", str(tmp_path / "healthy")]
    words = [sys.executable, "-c", code, str(tmp_path)]
    return Service("s3", words, dict(os.environ), check, tmp_path / "log", restarts=restarts)


def test_a_port_is_handed_out_once_and_to_no_connection() -> None:
    ports = [free_port() for _ in range(200)]
    assert len(set(ports)) == len(ports)
    given = Path("/proc/sys/net/ipv4/ip_local_port_range")
    first = int(given.read_text().split()[0]) if given.exists() else LISTENING.stop
    assert all(port in LISTENING and port < first for port in ports)


def test_the_error_of_a_service_that_ended_shows_its_log(tmp_path: Path) -> None:
    process = service(tmp_path, "import sys; print('address in use'); sys.exit(3)")
    process.start()
    with pytest.raises(StackError, match="s3 ended with 3") as found:
        process.wait(30)
    assert "address in use" in str(found.value)


COUNTS = """
import sys, time, pathlib
folder = pathlib.Path(sys.argv[1])
tries = len(list(folder.glob("try*")))
(folder / f"try{tries}").touch()
if tries < 2:
    sys.exit(1)
(folder / "healthy").touch()
time.sleep(60)
"""


def test_a_service_is_started_again_as_often_as_it_says(tmp_path: Path) -> None:
    process = service(tmp_path, COUNTS, restarts=2)
    process.start()
    process.wait(30)
    process.stop()
    assert len(list(tmp_path.glob("try*"))) == 3


def test_a_service_is_not_started_more_often(tmp_path: Path) -> None:
    process = service(tmp_path, COUNTS, restarts=1)
    process.start()
    with pytest.raises(StackError, match="s3 ended with 1"):
        process.wait(30)
    assert len(list(tmp_path.glob("try*"))) == 2
