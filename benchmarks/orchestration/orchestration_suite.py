"""Measure the cost of Prefect around the work (`make bench-orchestration`).

On the PostgreSQL and the server of tools/stack/compose_stack.py, with played cells
(benchmarks/orchestration/played.py):

    cached   nine cells that are all cached: at most 6 s
    busy     nine cells that burn 60 s of processor time each: at most 3 % for orchestration, and
             both cores at least 90 % busy while cells wait
    local    1,000 sleeping cells through the local executor: overhead a cell, and where it bends
    pool     200 sleeping cells through a work pool with 8 workers of one run each

Processor time of this process, of the server and of PostgreSQL is what orchestration costs; it is
reported beside wall time, which other work on the machine would make longer.
"""

import argparse
import asyncio
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from datetime import UTC, datetime
from pathlib import Path
from typing import Any
from unittest.mock import patch

import yaml

from benchmarks.orchestration.costs import Begun, Costs, each
from flows.runtime.environment import HEARTBEAT
from tools.stack.compose_stack import Stack, running

RESULTS = Path(__file__).parents[1] / "results" / "orchestration.json"
PARTS = ("cached", "busy", "local", "pool")
SETUPS = ("scratch", "pretrain", "curiosity")
NINE: dict[str, Any] = {"moves": ("hip_shake", "dance_b", "walk"), "setups": SETUPS, "seeds": (0,)}
POOL, DEPLOYMENT = "training", "bench"
QUARTERS = 4


def sleepers(count: int) -> dict[str, Any]:
    """Return a grid of about `count` cells of one move."""
    return {"moves": ("walk",), "setups": SETUPS, "seeds": tuple(range(count // len(SETUPS)))}


def study(name: str, grid: dict[str, Any], **more: Any) -> dict[str, Any]:
    """Return a study whose motions are as short as can be, if they are made."""
    return {"name": name, **grid, "pipeline": "smoke", "gate": False, **more}


def ablate(
    options: dict[str, Any],
    seconds: float,
    burn: bool,
    began: Callable[[], None] = lambda: None,
    motions: bool = False,
) -> None:
    """Run the flow over played cells.

    Args:
        motions: Make the motions of the moves, too; else they are played.
    """
    from benchmarks.orchestration.played import motionless, played
    from configs.study_config import Study
    from flows.ablation import ablation

    with played(seconds, burn, began), nullcontext() if motions else motionless():
        asyncio.run(ablation(Study(**options)))


def cached(stack: Stack, options: argparse.Namespace) -> dict[str, Any]:
    """Run nine cached cells, three times in this process, then three times by the command."""
    nine = study("cached", NINE, slots=2)
    ablate(nine, 0.0, False, motions=True)
    rounds, commands = [], []
    for _ in range(3):
        costs = Costs(stack)
        ablate(nine, 0.0, False, motions=True)
        rounds.append(costs.so_far())
    for _ in range(3):
        commands.append(_command(stack, nine))
    return {
        "cells": 9,
        "worst_s": max(r["wall_s"] for r in rounds),
        "worst_command_s": max(commands),
        "commands_s": commands,
        "rounds": rounds,
    }


def busy(stack: Stack, options: argparse.Namespace) -> dict[str, Any]:
    """Run nine cells of work on two slots."""
    ablate(study("first", {**sleepers(3), "seeds": (10_000,)}, slots=2), 0.0, False)
    costs, began = Costs(stack), Begun(stack)
    ablate(study(f"busy-{options.seconds:g}", NINE, slots=2), options.seconds, True, began)
    used = costs.so_far()
    rounds = 5  # nine cells on two slots: the last one is alone
    return {
        "cells": 9,
        "seconds_each": options.seconds,
        **used,
        "orchestration_cpu_share": round(used["orchestration_cpu_s"] / used["work_cpu_s"], 4),
        "wall_over_ideal": round(used["wall_s"] / (rounds * options.seconds), 4),
        "cores_busy_while_cells_wait": began.busy(cores=2),
    }


def local(stack: Stack, options: argparse.Namespace) -> dict[str, Any]:
    """Run more and more sleeping cells, many at once."""
    ablate(study("first", {**sleepers(3), "seeds": (10_000,)}, slots=2), 0.0, False)
    rows: list[dict[str, Any]] = []
    for count in options.counts:
        costs, began = Costs(stack), Begun(stack, every=5)
        grid = sleepers(count)
        ablate(study(f"sleep-{count}", grid, slots=options.slots), 1.0, False, began)
        used = costs.so_far()
        rows.append({"cells": began.count, **used, **each(used, began.count)})
        rows[-1]["by_quarters"] = began.by_parts(QUARTERS)
    return {"slots": options.slots, "sleep_s": 1.0, "rows": rows}


def pool(stack: Stack, options: argparse.Namespace) -> dict[str, Any]:
    """Run sleeping cells on workers, each a process of its own."""
    from flows import cells

    ablate(study("first", {**sleepers(3), "seeds": (10_000,)}, slots=2), 0.0, False)
    _deploy()
    costs = Costs(stack)
    with patch.object(cells, "DEPLOYMENT", f"cell/{DEPLOYMENT}"):
        ablate(study("pool", sleepers(options.runs), executor="work-pool"), 0.0, False)
    used, count = costs.so_far(), len(sleepers(options.runs)["seeds"]) * len(SETUPS)
    workers = {"workers_cpu_ms_each": round(1e3 * used["workers_cpu_s"] / count, 1)}
    return {"workers": options.workers, "cells": count, **used, **each(used, count), **workers}


def _command(stack: Stack, options: dict[str, Any]) -> float:
    """Return wall time of `robojackson ablation`, from the shell to its last word."""
    file = stack.folder / "study.yaml"
    file.write_text(yaml.safe_dump(json.loads(json.dumps(options))))
    began = time.monotonic()
    words = [sys.executable, "-m", "robojackson", "ablation", str(file), "--json"]
    subprocess.run(words, check=True, capture_output=True)
    return round(time.monotonic() - began, 2)


def _deploy() -> None:
    """Register the cell that sleeps."""
    from prefect.client.orchestration import get_client
    from prefect.utilities.callables import parameter_schema

    from benchmarks.orchestration.played import pooled

    folder = str(Path(__file__).parents[2])
    step = {"prefect.deployments.steps.set_working_directory": {"directory": folder}}
    with get_client(sync_client=True) as client:
        client.create_deployment(
            flow_id=client.create_flow(pooled),
            name=DEPLOYMENT,
            entrypoint="benchmarks.orchestration.played.pooled",
            work_pool_name=POOL,
            pull_steps=[step],
            parameter_openapi_schema=parameter_schema(pooled.fn).model_dump_for_openapi(),
        )


@contextmanager
def _server(folder: Path, workers: int) -> Iterator[Stack]:
    """Yield a stack whose server counts its calls, and this process as its client.

    With workers the store is the stack's; else it is a folder, as for one machine.
    """
    logged = {"PREFECT_SERVER_LOGGING_LEVEL": "INFO"}
    with running(folder, scale={"flow-worker": 0, "trainer": workers}, more=logged) as stack:
        ours = ("PREFECT_", "DO_NOT", *(("AWS_", "ROBOJACKSON_") if workers else ()))
        given = {n: v for n, v in stack.client().items() if n.startswith(ours)}
        os.environ.update(given | HEARTBEAT)  # without it the automation marks us as dead
        if not workers:
            os.environ["ROBOJACKSON_STORE"] = str(folder / "store")
        yield stack


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--part", choices=PARTS, help="only this part")
    parser.add_argument("--seconds", type=float, default=60.0, help="of work in a busy cell")
    parser.add_argument("--counts", type=int, nargs="+", default=[30, 120, 1000])
    parser.add_argument("--slots", type=int, default=32, help="cells at once in `local`")
    parser.add_argument("--runs", type=int, default=200, help="in `pool`")
    parser.add_argument("--workers", type=int, default=8, help="in `pool`")
    options = parser.parse_args()
    if options.part is None:  # Prefect knows one server a process
        for part in PARTS:
            words = [
                sys.executable,
                "-m",
                "benchmarks.orchestration.orchestration_suite",
                "--part",
                part,
            ]
            subprocess.run([*words, *sys.argv[1:]], check=True)
        return
    made = measured(options.part, options)
    print(json.dumps(made, indent=1), flush=True)
    known = json.loads(RESULTS.read_text()) if RESULTS.exists() else {}
    RESULTS.write_text(json.dumps({**known, options.part: made}, indent=1) + "\n")


def measured(part: str, options: argparse.Namespace) -> dict[str, Any]:
    """Return a part on a stack of its own, with how and when it was measured."""
    folder = Path(tempfile.mkdtemp(prefix="robojackson-bench-"))
    with _server(folder, options.workers if part == "pool" else 0) as stack:
        return {
            "command": " ".join(
                ["python -m benchmarks.orchestration.orchestration_suite", *sys.argv[1:]]
            ),
            "date": datetime.now(UTC).isoformat(timespec="seconds"),
            "load_before": [round(one, 2) for one in os.getloadavg()],
            **globals()[part](stack, options),
            "load_after": [round(one, 2) for one in os.getloadavg()],
        }


if __name__ == "__main__":
    main()
