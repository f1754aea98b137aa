"""Costs of a stack and a flow: wall time, processor time, calls of the server's API, disk."""

import os
import re
import subprocess
import time
from itertools import pairwise
from pathlib import Path

from tools.stack.compose_stack import Stack
from tools.stack.processes import cpu_seconds

CALL = re.compile(r'"(?:GET|POST|PATCH|PUT|DELETE) /api/')
ORCHESTRATION = ("flow_cpu_s", "server_cpu_s", "postgres_cpu_s")
WORK = ("work_cpu_s", "workers_cpu_s", "store_cpu_s")


class Costs:
    """Costs from now on."""

    def __init__(self, stack: Stack) -> None:
        self._stack, self._first = stack, self._read(stack)

    def so_far(self) -> dict[str, float]:
        """Return what was used since the beginning."""
        now = self._read(self._stack)
        used = {name: round(now[name] - self._first[name], 2) for name in now}
        known = sum(used[name] for name in (*ORCHESTRATION, *WORK))
        used["others_cpu_s"] = round(used.pop("machine_cpu_s") - known, 2)
        return {**used, "orchestration_cpu_s": round(sum(used[name] for name in ORCHESTRATION), 2)}

    @staticmethod
    def _read(stack: Stack) -> dict[str, float]:
        log = (stack.folder / "prefect-server.log").read_text(errors="replace")
        by_name = {name: cpu_seconds(_pid(stack, name)) for name in stack.services}
        return {
            "wall_s": time.monotonic(),
            "flow_cpu_s": _own_cpu_s(),
            "work_cpu_s": _below_cpu_s() - sum(by_name.values()),
            "server_cpu_s": by_name["prefect-server"],
            "postgres_cpu_s": by_name["postgres"],
            "store_cpu_s": by_name["s3"],
            "workers_cpu_s": sum(s for name, s in by_name.items() if name.startswith("trainer")),
            "machine_cpu_s": _machine_cpu_s(),
            "api_calls": len(CALL.findall(log)),
            "database_kb": _database_kb(stack),
        }


class Begun:
    """Costs at the start of every n-th cell; a reading takes 30 ms."""

    def __init__(self, stack: Stack, every: int = 1) -> None:
        self._every = every
        ours = {"prefect-server", "postgres"}
        self._ours = [_pid(stack, name) for name in ours]
        self._others = [_pid(stack, name) for name in stack.services if name not in ours]
        self.count = 0
        self.wall_s: list[float] = []
        self.work_s: list[float] = []
        self.orchestration_s: list[float] = []

    def __call__(self) -> None:
        """Count one cell, and read the costs at every n-th."""
        if self.count % self._every == 0:
            own = _own_cpu_s()
            self.wall_s.append(time.monotonic())
            services = sum(map(cpu_seconds, self._ours))
            others = sum(map(cpu_seconds, self._others))
            self.work_s.append(_below_cpu_s() - services - others)
            self.orchestration_s.append(own + services)
        self.count += 1

    def busy(self, cores: int) -> float:
        """Return the share of the cores that work used while cells waited for a slot."""
        work, wall = self.work_s[-1] - self.work_s[0], self.wall_s[-1] - self.wall_s[0]
        return round(work / (cores * wall), 4)

    def by_parts(self, parts: int) -> dict[str, list[float]]:
        """Return the cells begun a second, and what one cost, in equal parts of all of them."""
        last = len(self.wall_s) - 1
        ends = [round(n * last / parts) for n in range(parts + 1)]
        found: dict[str, list[float]] = {"cells_a_second": [], "cpu_ms_a_cell": []}
        for a, b in pairwise(ends):
            cells = (b - a) * self._every
            if cells:
                found["cells_a_second"].append(round(cells / (self.wall_s[b] - self.wall_s[a]), 3))
                spent = self.orchestration_s[b] - self.orchestration_s[a]
                found["cpu_ms_a_cell"].append(round(1e3 * spent / cells))
        return found


def each(used: dict[str, float], count: int) -> dict[str, float]:
    """Return the same for one of `count` cells."""
    figures = {"wall_ms": 1e3 * used["wall_s"], "cpu_ms": 1e3 * used["orchestration_cpu_s"]}
    figures |= {"calls": used["api_calls"], "database_kb": used["database_kb"]}
    return {f"{name}_each": round(value / count, 1) for name, value in figures.items()}


def _own_cpu_s() -> float:
    own = os.times()
    return own.user + own.system


def _below_cpu_s() -> float:
    """Return the CPU time of all processes below this one: cells and services of the stack."""
    return cpu_seconds(os.getpid()) - _own_cpu_s()


def _machine_cpu_s() -> float:
    """Return the CPU time of all processes; other people's work spoils wall times."""
    ticks = list(map(int, Path("/proc/stat").read_text().split("\n", 1)[0].split()[1:9]))
    user, nice, system, _idle, _iowait, irq, softirq, _steal = ticks
    return (user + nice + system + irq + softirq) / os.sysconf("SC_CLK_TCK")


def _database_kb(stack: Stack) -> float:
    """Return what the database takes on its disk."""
    ask = ["psql", "-U", "prefect", "-d", "prefect", "-Atc", "select pg_database_size('prefect')"]
    access = stack.services["postgres"].environment
    run = subprocess.run(ask, env=access, capture_output=True, text=True, check=True)
    return int(run.stdout) / 1e3


def _pid(stack: Stack, name: str) -> int:
    process = stack.services[name].process
    assert process is not None
    return process.pid
