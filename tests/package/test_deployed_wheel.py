"""A deployment of the installed package runs on a worker that knows no checkout."""

import json
import os
import signal
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from tests.package.conftest import Installed
from tools.stack.service import free_port

pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("package"), pytest.mark.timeout(600)]
DANCE = {
    "source": "clips/hip_shake.mp4",
    "config": "smoke",
    "overrides": {"gate": False, "train.trainer": "sb3"},
}
STEPS = 600
"""Of configs/smoke.yaml, which is shipped in the wheel."""


@contextmanager
def started(command: list[str], folder: Path, environment: dict[str, str]) -> Iterator[None]:
    """Yield a process of its own group, ended by Ctrl-C."""
    with (folder / "log.txt").open("ab") as log:
        process = subprocess.Popen(
            command, cwd=folder, env=environment, stdout=log, stderr=log, start_new_session=True
        )
        try:
            yield
        finally:
            os.killpg(process.pid, signal.SIGINT)
            try:
                process.wait(20)
            except subprocess.TimeoutExpired:
                os.killpg(process.pid, signal.SIGKILL)
                process.wait()


@pytest.mark.heavy
def test_a_deployed_dance_runs_from_the_wheel(installed: Installed, tmp_path: Path) -> None:
    require_deployed_dance(installed, tmp_path)


def require_deployed_dance(installed: Installed, folder: Path, limit_s: float = 280) -> None:
    """Start a server, a deployment and a worker of an environment, and dance once."""
    port, python = free_port(), str(installed.python)
    address = f"http://127.0.0.1:{port}/api"
    kept = {k: os.environ[k] for k in ("LANG", "LD_LIBRARY_PATH") if k in os.environ}
    environment = kept | {
        "PATH": f"{installed.root / 'bin'}:{os.environ['PATH']}",
        "HOME": str(folder),
        "PREFECT_HOME": str(folder / "prefect"),
        "ROBOJACKSON_STORE": str(folder / "store"),
        "OMP_NUM_THREADS": "1",
        "DO_NOT_TRACK": "1",
    }
    server = ["robojackson", "server", "--port", str(port)]
    with started([str(installed.root / "bin" / server[0]), *server[1:]], folder, environment):
        environment["PREFECT_API_URL"] = address
        deploy = ("robojackson", "deploy", "--wait", "100", "--json")
        result = installed.run(*deploy, cwd=folder, limit_s=limit_s, **environment)
        assert "dance/on-demand" in json.loads(result.stdout)["deployments"]
        worker = [python, "-m", "prefect", "worker", "start", "--pool", "flows"]
        with started(worker, folder, environment):
            time.sleep(1)
            given = [w for k, v in DANCE.items() for w in ("-p", f"{k}={json.dumps(v)}")]
            run = ("-m", "prefect", "deployment", "run", "dance/on-demand", *given, "--watch")
            done = installed.run("python", *run, cwd=folder, limit_s=limit_s, **environment)
    log = (folder / "log.txt").read_text(errors="replace")
    assert "Completed" in done.stdout, done.stdout + log[-3000:]
    pages = list((folder / "store" / "dances").glob("*/index.html"))
    assert len(pages) == 1
    training = json.loads((pages[0].parent / "training.json").read_text())
    assert training["steps"] >= STEPS
