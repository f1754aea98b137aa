"""A Prefect server that is not there, or that knows another password, is reported in one line."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import pytest
from prefect.settings import PREFECT_API_URL, temporary_settings

from configs.dance_book import Dance
from configs.study_config import Study
from flows import ablation, dance, find, refresh
from flows.runtime.deployments import deploy
from robojackson.errors import DeploymentFailed
from robojackson.pipeline.yaml_loader import load
from tests.fixtures.commands import LOADED, robojackson
from tools.stack.service import free_port

COMMANDS = {
    "dance": lambda: dance.run("clips/hip_shake.mp4", "smoke", {}),
    "ablation": lambda: ablation.run(load(Study, "studies/smoke")),
    "find": lambda: find.run(Dance(name="x", query="x"), "finding", {}),
    "refresh": lambda: refresh.run(None, "finding", {}),
    "deploy": deploy,
}


class Guarded(BaseHTTPRequestHandler):
    """A server like Prefect's with a password: without it, only the health check is answered."""

    def do_GET(self) -> None:
        self.send_response(200 if self.path.endswith("/health") else 401)
        self.send_header("Content-Length", "0")
        self.end_headers()

    def log_message(self, *args: object) -> None:
        """Log nothing."""


@pytest.fixture
def guarded() -> Iterator[str]:
    """Yield the address of a server that refuses us."""
    server = ThreadingHTTPServer(("127.0.0.1", 0), Guarded)
    server.daemon_threads = True
    threading.Thread(target=server.serve_forever, args=(0.02,), daemon=True).start()
    yield f"http://127.0.0.1:{server.server_port}/api"
    server.shutdown()
    server.server_close()


@contextmanager
def named(address: str) -> Iterator[None]:
    with temporary_settings({PREFECT_API_URL: address}):
        yield


@pytest.mark.parametrize("name", COMMANDS)
def test_a_server_that_refuses_us_is_reported_with_what_to_set(
    name: str, guarded: str, store_folder: Path
) -> None:
    result = rf"{guarded} refuses us \(401 Unauthorized\); set PREFECT_API_AUTH_STRING"
    with named(guarded), pytest.raises(DeploymentFailed, match=result):
        COMMANDS[name]()


@pytest.mark.medium
@pytest.mark.parametrize("name", COMMANDS)
def test_a_server_that_is_not_there_is_reported_with_what_to_do(
    name: str, store_folder: Path
) -> None:
    address = f"http://127.0.0.1:{free_port()}/api"
    result = rf"{address} does not answer \(.*\); start it"
    with named(address), pytest.raises(DeploymentFailed, match=result):
        COMMANDS[name]()


@pytest.mark.slow
def test_the_command_says_it_in_one_line(tmp_path: Path) -> None:
    address = f"http://127.0.0.1:{free_port()}/api"
    environment = {"PREFECT_API_URL": address, "ROBOJACKSON_STORE": str(tmp_path / "store")}
    result = robojackson("ablation", "smoke", **environment)
    lines = [line for line in result.err.splitlines() if line and not line.startswith(LOADED)]
    assert (result.code, len(lines)) == (1, 1)
    assert lines[0].startswith("robojackson: DeploymentFailed: the Prefect server of PREFECT_API_")
