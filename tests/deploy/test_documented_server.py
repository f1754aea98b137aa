"""The server path of docs/deployment.md, word for word, on SQLite and on PostgreSQL."""

import json
import os
import re
import signal
import subprocess
import sys
import time
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest

from storage.store import Store
from storage.study_tables import CELL, query
from tools.stack import postgres
from tools.stack.processes import under
from tools.stack.service import ROOT, free_port

pytestmark = [pytest.mark.cluster, pytest.mark.timeout(1800)]
DOCUMENT = ROOT / "docs" / "deployment.md"
SECTION = "## One machine, a server you start"
API = "http://127.0.0.1:4200/api"
"""As the document has it."""
ACCESS = {"POSTGRES_USER": "prefect", "POSTGRES_PASSWORD": "documented", "POSTGRES_DB": "prefect"}
CELLS = 9
RECORDED_S = 4.0
SUBFLOW = "cell-"
"""How Prefect names the task run that stands for the run of a cell."""
DANCE: dict[str, Any] = {"train.steps": 300, "train.trainer": "sb3"}


def block() -> str:
    """Return the first commands of the section."""
    section = DOCUMENT.read_text().split(SECTION, 1)[1]
    found = re.search(r"```sh\n(.*?)```", section, re.DOTALL)
    assert found
    return found[1]


@dataclass(frozen=True)
class Documented:
    """A machine on which somebody has given the documented commands.

    Attributes:
        environment: Of that shell, with the address of the server.
        log: Output of all commands.
        code: Exit code of the last of them.
    """

    environment: dict[str, str]
    log: Path
    code: int

    @property
    def store(self) -> Store:
        return Store(self.environment["ROBOJACKSON_STORE"])

    def run(self, *words: object) -> subprocess.CompletedProcess[str]:
        """Give one more command in that shell."""
        return subprocess.run(
            list(map(str, words)), env=self.environment, cwd=ROOT, capture_output=True, text=True,
            timeout=900, check=False,
        )  # fmt: skip

    def robojackson(self, *words: object) -> dict[str, Any]:
        result = self.run(sys.executable, "-m", "robojackson", *words, "--json")
        assert result.returncode == 0, result.stderr
        return dict(json.loads(result.stdout))

    def deployment(self, name: str, **parameters: object) -> None:
        given = [w for k, v in parameters.items() for w in ("-p", f"{k}={json.dumps(v)}")]
        words = ("-m", "prefect", "deployment", "run", name, *given, "--watch")
        result = self.run(sys.executable, *words)
        assert result.returncode == 0, result.stdout[-2000:]


@contextmanager
def executed() -> Iterator[list[str]]:
    """Collect the names of the task runs of a block that were not read from the cache."""
    names: list[str] = []
    began = {"task_runs": {"start_time": {"after_": datetime.now(UTC).isoformat()}}}
    yield names
    runs: list[dict[str, Any]] = []
    known = -1  # the server writes them down some seconds later
    while len(runs) != known or not all(run["end_time"] for run in runs):
        known = len(runs)
        time.sleep(RECORDED_S)
        runs = ask(API, "task_runs/filter", limit=200, **began)
    assert runs
    tasks = [run for run in runs if not run["name"].startswith(SUBFLOW)]
    names += [run["name"] for run in tasks if run["state_name"] != "Cached"]


def ask(api: str, path: str, **body: Any) -> list[dict[str, Any]]:
    """Return the answer of a server to a request of its API."""
    request = urllib.request.Request(
        f"{api}/{path}", json.dumps(body).encode(), {"Content-Type": "application/json"}
    )
    with urllib.request.urlopen(request, timeout=30) as answer:
        return list(json.load(answer))


def bare(folder: Path) -> dict[str, str]:
    """Return the environment of a user who has set the place of the store alone."""
    home = folder / "home"
    home.mkdir()
    kept = {k: os.environ[k] for k in ("PATH", "LANG", "LD_LIBRARY_PATH") if k in os.environ}
    fixed = {"HOME": str(home), "PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1"}
    return {**kept, **fixed, "ROBOJACKSON_STORE": str(folder / "store")}


def end(folder: Path) -> None:
    """End all that was started with a home in the folder."""
    for how in (signal.SIGTERM, signal.SIGKILL):
        for found in under(folder):
            os.kill(found.pid, how)


@pytest.fixture(scope="module", params=[pytest.param("sqlite", marks=pytest.mark.ci), "postgresql"])
def documented(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Documented]:
    folder = tmp_path_factory.mktemp(request.param)
    environment, log = bare(folder), folder / "log.txt"
    database = None
    if request.param == "postgresql":
        port = free_port()
        check = "pg_isready -U prefect -d prefect"
        database = postgres.service(ACCESS, check, port, folder, folder / "postgres.log")
        database.start()
        database.wait()
        address = f"postgresql+asyncpg://prefect:documented@127.0.0.1:{port}/prefect"
        environment["PREFECT_SERVER_DATABASE_CONNECTION_URL"] = address
    try:
        with log.open("wb") as out:
            run = subprocess.run(
                ["bash", "-c", block()], env=environment, cwd=ROOT, stdout=out, stderr=out,
                timeout=1500, check=False,
            )  # fmt: skip
        yield Documented({**environment, "PREFECT_API_URL": API}, log, run.returncode)
    finally:
        end(folder / "home")
        if database is not None:
            database.stop()
            postgres.remove(folder)


def test_the_documented_study_ends_well(documented: Documented) -> None:
    assert documented.code == 0, documented.log.read_text()[-4000:]
    for table in CELL:
        cells = f"SELECT DISTINCT move, setup, seed FROM {table}"
        assert len(query(documented.store, cells)) == CELLS


def test_the_server_writes_no_traceback(documented: Documented) -> None:
    text = documented.log.read_text()
    assert "database is locked" not in text
    assert "Traceback" not in text


def test_the_log_names_the_cell_that_a_line_is_about(documented: Documented) -> None:
    assert "Task run 'train_policy-scratch-walk-s0'" in documented.log.read_text()


def test_the_command_line_reads_what_workers_have_computed(documented: Documented) -> None:
    with executed() as names:
        documented.robojackson("ablation", "smoke")
    assert names == []


def test_workers_read_what_the_command_line_has_computed(documented: Documented) -> None:
    given = [word for pair in DANCE.items() for word in ("--set", "=".join(map(str, pair)))]
    documented.robojackson("dance", "clips/hip_shake.mp4", "--config", "smoke", *given)
    given_there = {"source": "clips/hip_shake.mp4", "config": "smoke", "overrides": DANCE}
    with executed() as names:
        documented.deployment("dance/on-demand", **given_there)
    assert names == []


def test_a_dance_of_a_worker_is_answered_without_prefect(documented: Documented) -> None:
    overrides = {**DANCE, "train.seed": 1}
    documented.deployment(
        "dance/on-demand", source="clips/hip_shake.mp4", config="smoke", overrides=overrides
    )
    given = [word for pair in overrides.items() for word in ("--set", "=".join(map(str, pair)))]
    before = len(ask(API, "flow_runs/filter", limit=200))
    documented.robojackson("dance", "clips/hip_shake.mp4", "--config", "smoke", *given)
    assert len(ask(API, "flow_runs/filter", limit=200)) == before


def test_each_dance_and_study_has_an_artifact_of_its_own(documented: Documented) -> None:
    keys = {artifact["key"] for artifact in ask(API, "artifacts/latest/filter", limit=200)}
    assert keys >= {"dance-hip-shake", "study-smoke"}


def test_the_nightly_refresh_is_planned(documented: Documented) -> None:
    scheduled = {"flow_runs": {"state": {"type": {"any_": ["SCHEDULED"]}}}}
    planned = ask(API, "flow_runs/filter", limit=200, **scheduled)
    assert "03:00" in {run["expected_start_time"][11:16] for run in planned}


BROWSER = ("chromium", "--headless", "--no-sandbox", "--disable-gpu", "--no-first-run",
           "--disable-background-networking", "--disable-component-update", "--disable-sync",
           "--host-resolver-rules=MAP robo.test 127.0.0.1", "--virtual-time-budget=60000",
    "--window-size=1400,3000",
           "--dump-dom")  # fmt: skip


def test_the_runs_page_shows_runs_on_any_port_and_host_name(tmp_path: Path) -> None:
    port, environment = free_port(), bare(tmp_path)
    api = f"http://127.0.0.1:{port}/api"
    command = [sys.executable, "-m", "robojackson", "server", "--port", str(port)]
    server = subprocess.Popen(command, env=environment, cwd=ROOT)
    try:
        environment["PREFECT_API_URL"] = api
        say = "from prefect import flow; flow(lambda: 1, name='shown', flow_run_name='run-seen')()"
        waiting = "from flows.runtime.prefect_server import await_server; await_server(90)"
        for code in (waiting, say):
            subprocess.run([sys.executable, "-c", code], env=environment, cwd=ROOT, check=True)
        data = f"--user-data-dir={tmp_path / 'chromium'}"
        page = subprocess.run(
            [*BROWSER, data, f"http://robo.test:{port}/runs"], env=environment,
            capture_output=True, text=True, timeout=120, check=True,
        ).stdout  # fmt: skip
        assert "run-seen" in page
    finally:
        server.terminate()
        server.wait(30)
        end(tmp_path / "home")
