"""`robojackson doctor --report`: enough for an issue, nothing about the person."""

import getpass
import json
import platform
import re
import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path

import pytest

from robojackson.cli.diagnosis.issue_report import server_state, store_state
from tests.fixtures.commands import in_process

SECRET = "hunter2"


class PrefectVersion(BaseHTTPRequestHandler):
    """Answers as a Prefect server does when its version is requested."""

    def do_GET(self) -> None:
        self.send_response(200 if self.path == "/api/admin/version" else 404)
        self.end_headers()
        self.wfile.write(json.dumps("3.8.8").encode())

    def log_message(self, *what: object) -> None:
        """Write nothing."""


@pytest.fixture
def server() -> Iterator[str]:
    with HTTPServer(("127.0.0.1", 0), PrefectVersion) as made:
        threading.Thread(target=made.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{made.server_port}/api"
        made.shutdown()


def test_the_report_is_a_table_in_markdown_with_what_an_issue_needs() -> None:
    result = in_process("doctor", "--report")
    head, blank, *table = result.out.splitlines()
    assert (result.code, head, blank) == (0, "### robojackson doctor", "")
    assert all(line.startswith("|") and line.endswith("|") for line in table)
    rows = dict(line.strip("| ").split(" | ", 1) for line in table[2:])
    assert platform.python_version() in rows["Python"]
    assert "mujoco" in rows["packages"]
    assert {"platform", "CPU", "OpenGL", "Prefect server", "store"} <= set(rows)


def test_the_report_names_no_home_no_user_and_no_secret(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    home = tmp_path / "somebody"
    (home / "store").mkdir(parents=True)
    text = in_process(
        "doctor",
        "--report",
        HOME=str(home),
        ROBOJACKSON_STORE=str(home / "store"),
        PREFECT_API_URL=f"http://admin:{SECRET}@127.0.0.1:9/api",
        AWS_SECRET_ACCESS_KEY=SECRET,
    )
    words = {"somebody", SECRET, platform.node()}
    words |= {getpass.getuser()} - {"root"}  # a word that others use
    found = re.findall(r"[\w/.-]+", text.out)
    assert [word for word in words if any(word in each.split("/") for each in found)] == []
    assert str(tmp_path) not in text.out
    assert "the folder of ROBOJACKSON_STORE: writable" in text.out


def test_a_server_that_answers_is_named_with_its_version(server: str) -> None:
    assert server_state({"PREFECT_API_URL": server}) == "on this machine, answers: Prefect 3.8.8"


def test_another_server_than_prefects_is_said(server: str) -> None:
    assert server_state({"PREFECT_API_URL": f"{server}/x"}) == (
        "on this machine, answers with HTTP 404"
    )


@pytest.mark.parametrize("address", ["http://127.0.0.1:9/api", "no address", "http://[::1/api"])
def test_a_server_that_does_not_answer_is_no_error(address: str) -> None:
    assert server_state({"PREFECT_API_URL": address}).startswith(
        "PREFECT_API_URL is set, no answer"
    )


def test_without_a_server_the_report_says_what_happens() -> None:
    assert server_state({}) == "PREFECT_API_URL is not set: each command starts one of its own"


def test_a_bucket_is_said_by_its_kind_alone() -> None:
    assert store_state({"ROBOJACKSON_STORE": "s3://mine/dances"}) == "s3:// address"
