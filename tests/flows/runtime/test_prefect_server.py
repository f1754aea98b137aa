"""A Prefect server that is not there, or that knows another password, is reported in one line."""

import asyncio
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
from flows.runtime.prefect_server import require_deployment, require_server
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


class Page(BaseHTTPRequestHandler):
    """A server that has no such page."""

    code = 404

    def do_GET(self) -> None:
        self.send_response(self.code)
        self.send_header("Content-Length", "0")
        self.end_headers()

    def log_message(self, *args: object) -> None:
        """Log nothing."""


class Guarded(Page):
    """A server like Prefect's with a password: without it, only the health check is answered."""

    code = 401

    def do_GET(self) -> None:
        if self.path.endswith("/health"):
            self.code = 200
        super().do_GET()


@contextmanager
def served(handler: type[BaseHTTPRequestHandler]) -> Iterator[str]:
    """Yield the address of a server without its /api."""
    server = ThreadingHTTPServer(("127.0.0.1", 0), handler)
    server.daemon_threads = True
    threading.Thread(target=server.serve_forever, args=(0.02,), daemon=True).start()
    yield f"http://127.0.0.1:{server.server_port}"
    server.shutdown()
    server.server_close()


@pytest.fixture
def guarded() -> Iterator[str]:
    """Yield the address of a server that refuses us."""
    with served(Guarded) as address:
        yield f"{address}/api"


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


def test_an_address_without_its_end_is_reported_with_it() -> None:
    with served(Page) as address, named(f"{address}/"):
        expected = (
            rf"PREFECT_API_URL={address}/ is no address .*: set PREFECT_API_URL={address}/api$"
        )
        with pytest.raises(DeploymentFailed, match=expected):
            require_server()


def test_a_deployment_that_a_server_does_not_have_is_reported_with_what_registers_it() -> None:
    with served(Page) as address, named(f"{address}/api"):
        expected = "no deployment cell/pool.*robojackson server.*robojackson deploy.*pool training"
        with pytest.raises(DeploymentFailed, match=expected):
            asyncio.run(require_deployment("cell/pool"))


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
