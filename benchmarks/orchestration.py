"""What Prefect costs around the work (`make bench-orchestration`; results/orchestration.json).

On the PostgreSQL and the server of tools/stack.py, with played cells (benchmarks/played.py):

    cached   nine cells that are all cached: at most 6 s
    busy     nine cells that burn 60 s of processor time each: at most 3 % for orchestration, and
             both cores at least 90 % busy
    local    1,000 sleeping cells through the local executor: overhead a cell, and where it bends
    pool     runs on a work pool with 8 workers of one run each: overhead a run

Processor time of this process, of the server and of PostgreSQL is what orchestration costs; it is
told beside wall time, which other work on the machine would make longer.
"""

import argparse
import asyncio
import json
import os
import re
import subprocess
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from tools.processes import cpu_seconds
from tools.stack import Stack, running

RESULTS = Path(__file__).parent / "results" / "orchestration.json"
PARTS = ("cached", "busy", "local", "pool")
SETUPS = ("scratch", "pretrain", "curiosity")
CALL = re.compile(r'"(?:GET|POST|PATCH|PUT|DELETE) /api/')


class Costs:
    """What is used from now on: wall time, processor time, calls of the server's API."""

    def __init__(self, stack: Stack) -> None:
        self._stack, self._first = stack, self._read(stack)

    def so_far(self) -> dict[str, float]:
        now = self._read(self._stack)
        return {name: round(now[name] - self._first[name], 2) for name in now}

    @staticmethod
    def _read(stack: Stack) -> dict[str, float]:
        own = os.times()
        log = (stack.folder / "prefect-server.log").read_text(errors="replace")
        return {
            "wall_s": time.monotonic(),
            "flow_cpu_s": own.user + own.system,
            "work_cpu_s": own.children_user + own.children_system,
            "server_cpu_s": cpu_seconds(_pid(stack, "prefect-server")),
            "postgres_cpu_s": cpu_seconds(_pid(stack, "postgres")),
            "api_calls": len(CALL.findall(log)),
            "database_kb": _database_kb(stack),
        }


def ablate(name: str, seeds: int, seconds: float, burn: bool, slots: int) -> None:
    """Run the flow over played cells: 3 x `seeds` of them."""
    from benchmarks.played import played
    from configs.study import Study
    from flows.ablation import ablation

    given: dict[str, Any] = {"moves": ("walk",), "setups": SETUPS, "seeds": tuple(range(seeds))}
    with played(seconds, burn):
        asyncio.run(ablation(Study(name=name, **given, pipeline="smoke", slots=slots)))


def cached(stack: Stack, wanted: argparse.Namespace) -> dict[str, Any]:
    """Nine cells again, three times."""
    ablate("cached", 3, 0.0, False, 2)
    rounds = []
    for _ in range(3):
        costs = Costs(stack)
        ablate("cached", 3, 0.0, False, 2)
        rounds.append(costs.so_far())
    return {"cells": 9, "best_s": min(r["wall_s"] for r in rounds), "rounds": rounds}


def busy(stack: Stack, wanted: argparse.Namespace) -> dict[str, Any]:
    """Nine cells of work on two slots; the motion was made before."""
    ablate("motion", 1, 0.0, False, 2)
    costs = Costs(stack)
    ablate(f"busy-{wanted.seconds:g}", 3, wanted.seconds, True, 2)
    used = costs.so_far()
    spent = used["flow_cpu_s"] + used["server_cpu_s"] + used["postgres_cpu_s"]
    rounds = 5  # nine cells on two slots: the last one is alone
    return {
        "cells": 9,
        "seconds_each": wanted.seconds,
        **used,
        "orchestration_cpu_share": round(spent / used["work_cpu_s"], 4),
        "wall_over_ideal": round(used["wall_s"] / (rounds * wanted.seconds), 4),
        "cores_busy": round(used["work_cpu_s"] / (2 * used["wall_s"]), 4),
    }


def local(stack: Stack, wanted: argparse.Namespace) -> dict[str, Any]:
    """More and more sleeping cells, many at once."""
    ablate("motion", 1, 0.0, False, 2)
    rows = []
    for count in wanted.counts:
        costs = Costs(stack)
        ablate(f"sleep-{count}", count // 3, 1.0, False, wanted.slots)
        used = costs.so_far()
        rows.append({"cells": count // 3 * 3, **used, **_each(used, count // 3 * 3)})
    return {"slots": wanted.slots, "sleep_s": 1.0, "rows": rows}


def pool(stack: Stack, wanted: argparse.Namespace) -> dict[str, Any]:
    """Runs that sleep on workers, each a process of its own."""
    from prefect.deployments import arun_deployment

    async def all_runs() -> list[Any]:
        ask: dict[str, Any] = {"parameters": {"seconds": 1.0}, "timeout": 3600}
        return await asyncio.gather(
            *(arun_deployment("nap/bench", **ask) for _ in range(wanted.runs))
        )

    _deploy_nap()
    costs = Costs(stack)
    runs = asyncio.run(all_runs())
    used = costs.so_far()
    ended = sum(run.state.is_completed() for run in runs)
    workers = stack.scale["trainer"]
    return {"workers": workers, "runs": wanted.runs, "completed": ended, **used} | _each(
        used, wanted.runs
    )


def _each(used: dict[str, float], count: int) -> dict[str, float]:
    spent = used["flow_cpu_s"] + used["server_cpu_s"] + used["postgres_cpu_s"]
    figures = {"wall_ms": 1e3 * used["wall_s"], "cpu_ms": 1e3 * spent}
    figures |= {"calls": used["api_calls"], "database_kb": used["database_kb"]}
    return {f"{name}_each": round(value / count, 1) for name, value in figures.items()}


def _deploy_nap() -> None:
    from prefect.client.orchestration import get_client

    from benchmarks.played import nap

    folder = str(Path(__file__).parent.parent)
    step = {"prefect.deployments.steps.set_working_directory": {"directory": folder}}
    with get_client(sync_client=True) as client:
        client.create_deployment(
            flow_id=client.create_flow(nap),
            name="bench",
            entrypoint="benchmarks.played.nap",
            work_pool_name="training",
            pull_steps=[step],
            parameter_openapi_schema=nap_schema(),
        )


def nap_schema() -> dict[str, Any]:
    from prefect.utilities.callables import parameter_schema

    from benchmarks.played import nap

    return parameter_schema(nap.fn).model_dump_for_openapi()


def _database_kb(stack: Stack) -> float:
    """What the database takes on its disk."""
    ask = ["psql", "-U", "prefect", "-d", "prefect", "-Atc", "select pg_database_size('prefect')"]
    access = stack.services["postgres"].environment
    run = subprocess.run(ask, env=access, capture_output=True, text=True, check=True)
    return int(run.stdout) / 1e3


def _pid(stack: Stack, name: str) -> int:
    process = stack.services[name].process
    assert process is not None
    return process.pid


@contextmanager
def _server(folder: Path, workers: int) -> Iterator[Stack]:
    """A stack whose server counts its calls, and this process as its client."""
    logged = {"PREFECT_SERVER_LOGGING_LEVEL": "INFO", "PREFECT_LOGGING_LEVEL": "WARNING"}
    scale = {"flow-worker": 0, "trainer": workers}
    with running(folder, scale=scale, more=logged) as stack:
        client = {n: v for n, v in stack.client().items() if n.startswith(("PREFECT_", "DO_NOT"))}
        del client["PREFECT_RESULTS_DEFAULT_STORAGE_BLOCK"]
        os.environ.update(client)
        os.environ["ROBOJACKSON_STORE"] = str(folder / "store")
        os.environ["PREFECT_LOCAL_STORAGE_PATH"] = str(folder / "records")
        yield stack


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--part", action="append", choices=PARTS, help="only this part")
    parser.add_argument("--seconds", type=float, default=60.0, help="of work in a busy cell")
    parser.add_argument("--counts", type=int, nargs="+", default=[30, 99, 300, 999])
    parser.add_argument("--slots", type=int, default=32, help="cells at once in `local`")
    parser.add_argument("--runs", type=int, default=200, help="in `pool`")
    parser.add_argument("--workers", type=int, default=8, help="in `pool`")
    wanted = parser.parse_args()
    parts = wanted.part or PARTS
    folder = Path(tempfile.mkdtemp(prefix="robojackson-bench-"))
    known = json.loads(RESULTS.read_text()) if RESULTS.exists() else {}
    with _server(folder, wanted.workers if "pool" in parts else 0) as stack:
        for part in parts:
            known[part] = globals()[part](stack, wanted)
            known[part]["load"] = [round(one, 1) for one in os.getloadavg()]
            print(part, json.dumps(known[part], indent=1), flush=True)
            RESULTS.write_text(json.dumps(known, indent=1) + "\n")


if __name__ == "__main__":
    main()
