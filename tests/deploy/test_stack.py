"""The whole stack as processes: the ablation by `prefect deployment run`, then again from cache."""

import base64
import json
import os
import re
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from typing import Any

import pytest
import s3fs

from tests.chaos.trial import STUDY
from tools.stack.compose_stack import QUICK, Stack, running
from tools.stack.processes import Found, under

pytestmark = [pytest.mark.cluster, pytest.mark.timeout(2400)]
AGAIN_S = 60.0
"""Nine cached cells: a start of Python with all that the study imports, and no worker."""
WORK = "robojackson.cli train"
LONG = {"steps": 200_000}
TRAINERS = 2


@pytest.fixture(scope="module")
def stack(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Stack]:
    folder = tmp_path_factory.mktemp("stack")
    with running(folder, scale={"trainer": TRAINERS}, more=QUICK) as found:
        yield found


def command(stack: Stack, *words: str, **more: str) -> subprocess.CompletedProcess[str]:
    """Run a command beside the stack."""
    environment = {**stack.client(), **more}
    run = [sys.executable, "-m", *words]
    return subprocess.run(
        run, env=environment, capture_output=True, text=True, timeout=1800, check=False
    )


def prefect(stack: Stack, *words: str, **more: str) -> subprocess.CompletedProcess[str]:
    return command(stack, "prefect", *words, **more)


def ask(stack: Stack, sql: str) -> list[dict[str, Any]]:
    run = command(stack, "robojackson", "metrics", "--sql", sql, "--json")
    assert run.returncode == 0, run.stderr
    return list(json.loads(run.stdout)["rows"])


def begin(stack: Stack, **given: Any) -> str:
    """Start a small study on the workers; the id of its run."""
    study = json.dumps({**STUDY, "executor": "work-pool", **given})
    output = prefect(stack, "deployment", "run", "ablation/smoke", "-p", f"study={study}").stdout
    found = re.search(r"UUID: ([0-9a-f-]{36})", output)
    assert found, output
    return found[1]


def inspect(stack: Stack, run: str) -> dict[str, Any]:
    result = prefect(stack, "flow-run", "inspect", run, "--output", "json")
    return dict(json.loads(result.stdout)) if result.returncode == 0 else {}


def listed(stack: Stack, *words: str) -> list[dict[str, Any]]:
    """Return the runs that the server lists."""
    result = prefect(stack, "flow-run", "ls", *words, "--output", "json")
    return list(json.loads(result.stdout)) if result.returncode == 0 else []


def until(question: Callable[[], Any], seconds: float = 900.0) -> Any:
    """Return the first answer that is not empty."""
    end = time.monotonic() + seconds
    while not (answer := question()) and time.monotonic() < end:
        time.sleep(0.5)
    assert answer
    return answer


def ended(stack: Stack, run: str) -> dict[str, Any]:
    state = inspect(stack, run).get("state") or {}
    return state if state.get("type") in ("COMPLETED", "FAILED", "CRASHED", "CANCELLED") else {}


def trainings(stack: Stack) -> list[Found]:
    return [found for found in under(stack.folder / "home") if WORK in found.command]


def others(stack: Stack) -> list[Found]:
    """Return every process but those of the services."""
    services = stack.pids
    return [f for f in under(stack.folder / "home") if f.pid not in services]


def test_nine_cells_leave_nine_tables_and_a_second_run_finds_them(stack: Stack) -> None:
    first = prefect(stack, "deployment", "run", "ablation/smoke", "--watch")
    assert first.returncode == 0, first.stdout[-2000:]
    cells = "SELECT DISTINCT move, setup, seed FROM {} ORDER BY ALL"
    trained = ask(stack, cells.format("episodes"))
    assert len(trained) == 9
    assert ask(stack, cells.format("evaluations")) == trained
    began = time.monotonic()
    again = prefect(stack, "deployment", "run", "ablation/smoke", "--watch")
    assert again.returncode == 0, again.stdout[-2000:]
    assert time.monotonic() - began < AGAIN_S
    assert ask(stack, "SELECT count(*) AS n FROM runs") == [{"n": 9}]


@pytest.mark.ci
def test_a_killed_cell_is_named_and_its_neighbour_is_in_the_tables(stack: Stack) -> None:
    run = begin(stack, name="killed", retries=0, steps=2000)
    assert until(lambda: trainings(stack))[0].kill()
    state = until(lambda: ended(stack, run))
    assert state["type"] == "FAILED"
    name = re.search(r"1 of 2 cells failed \((\w+)-hip_shake-s0", state["message"])
    assert name, state["message"]
    rows = ask(stack, "SELECT DISTINCT setup FROM episodes WHERE study = 'killed' ORDER BY ALL")
    assert {row["setup"] for row in rows} == set(STUDY["setups"]) - {name[1]}


def test_a_cancelled_run_leaves_no_process(stack: Stack) -> None:
    run = begin(stack, name="cancelled", **LONG)
    until(lambda: len(trainings(stack)) == TRAINERS)
    assert prefect(stack, "flow-run", "cancel", run).returncode == 0
    assert until(lambda: not others(stack), 300.0)
    assert until(lambda: ended(stack, run), 60.0)["type"] == "CANCELLED"


def test_the_runs_of_a_dead_worker_are_marked_crashed(stack: Stack) -> None:
    run = begin(stack, name="dead", retries=0, setups=["scratch"], **LONG)
    home = until(lambda: trainings(stack))[0].home
    worker = stack.services[home.name]
    assert worker.murder()
    for left in under(home):
        left.kill()  # false for a training: it dies with its parent
    assert until(lambda: not under(home), 30.0)
    state = until(lambda: ended(stack, run))
    worker.start()
    assert state["type"] == "FAILED"
    assert "has not been heard of" in state["message"]
    dead = [r for r in listed(stack, "--state-type", "CRASHED") if r["flow_id"]]
    assert [r["name"] for r in dead] == ["scratch-hip_shake-s0"]


@pytest.mark.ci
def test_nonsense_is_refused_before_a_run_starts(stack: Stack) -> None:
    wrong = json.dumps({"name": "x", "setups": ["bogus"]})
    result = prefect(stack, "deployment", "run", "ablation/smoke", "-p", f"study={wrong}")
    assert result.returncode != 0
    assert "bogus" in result.stdout + result.stderr


@pytest.mark.ci
def test_a_dance_is_requested_by_its_name_and_not_by_nothing(stack: Stack) -> None:
    result = prefect(stack, "deployment", "run", "dance/on-demand", "-p", "source= ")
    assert result.returncode != 0
    assert "source" in result.stdout + result.stderr


@pytest.mark.ci
def test_the_nightly_refresh_is_planned_by_the_server(stack: Stack) -> None:
    planned = until(lambda: listed(stack, "--flow-name", "refresh", "--state", "Scheduled"), 120.0)
    assert {run["expected_start_time"][11:16] for run in planned} == {"03:00"}


@pytest.mark.ci
def test_the_server_refuses_strangers(stack: Stack) -> None:
    run = prefect(stack, "deployment", "ls", PREFECT_API_AUTH_STRING="robojackson:wrong")
    assert run.returncode != 0


def test_no_secret_is_in_logs_results_pages_or_the_database(stack: Stack) -> None:
    """After what the tests above have run: studies that ended well, failed, and were refused."""
    given = {
        **stack.given,
        "HEADER": base64.b64encode(stack.given["PREFECT_AUTH"].encode()).decode(),
    }
    secrets = {name: value.rpartition(":")[2] for name, value in given.items()}
    places = {path.name: path.read_bytes() for path in stack.folder.glob("*.log")}
    assert {"prefect-server.log", "flow-worker.log", "trainer.log"} <= set(places)
    places |= {"database": dumped(stack), **kept(stack)}
    homes = (stack.folder / "home").rglob("*")
    places |= {str(path): path.read_bytes() for path in homes if path.is_file()}
    found = [
        (n, p) for n, secret in secrets.items() for p in places if secret.encode() in places[p]
    ]
    assert found == []


def dumped(stack: Stack) -> bytes:
    """Return everything in the database of Prefect's server: runs, logs, artifacts, blocks,
    variables."""
    access = {"PGPASSWORD": stack.given["POSTGRES_BACKUP_PASSWORD"]}
    access["PGPORT"] = str(stack.ports["postgres"])
    words = ["pg_dump", "-h", "127.0.0.1", "-U", "backup", "prefect"]
    text = subprocess.run(
        words, env={**os.environ, **access}, capture_output=True, check=True
    ).stdout
    assert b"flow_run" in text
    return text


def kept(stack: Stack) -> dict[str, bytes]:
    """Return the files of the result store: tables, pages, records."""
    own = stack.client()
    url = f"http://127.0.0.1:{stack.ports['s3']}"
    system = s3fs.S3FileSystem(
        key=own["AWS_ACCESS_KEY_ID"], secret=own["AWS_SECRET_ACCESS_KEY"], skip_instance_cache=True,
        client_kwargs={"endpoint_url": url, "region_name": "us-east-1"},
    )  # fmt: skip
    files = system.find(own["ROBOJACKSON_STORE"].removeprefix("s3://"))
    assert files
    return {name: system.cat_file(name) for name in files}
