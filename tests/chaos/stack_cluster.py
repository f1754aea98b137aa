"""The stack of docker-compose.yml as a place where chaos is tried."""

import os
import random
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, ClassVar

from storage.store import Store
from tests.chaos.cut_wire import Proxy
from tests.chaos.restarts import Restarts
from tests.chaos.trial import wait
from tools.stack.compose_stack import QUICK, Stack
from tools.stack.processes import Found, under
from tools.stack.service import ROOT, Service

DEPLOYMENT = "ablation/smoke"
TRAINERS = 2
CUT_S = (5.0, 20.0)
NEEDED_S = 60.0
"""What a wire that is cut waits for somebody who needs it."""
GONE_S = 15.0
"""After which a parent whose process is not there is given up."""
FLOW, CELL = "flow-worker", "trainer"
WORK = ("robojackson.cli train", "robojackson.cli evaluate")
ENGINE = "prefect.engine"


class Cluster:
    """A running stack.

    Attributes:
        store: Store of the results.
        kinds: What can happen to it: does it and returns what it hit, or None if it cannot now.
    """

    KINDS: ClassVar = ("cell", "worker", "machine", "parent", "server", "database", "wire")

    def __init__(self, stack: Stack, wire: Proxy) -> None:
        self._stack, self._wire = stack, wire
        self._homes = stack.folder / "home"
        self._missing: float | None = None
        self.store = Store(stack.client()["ROBOJACKSON_STORE"])
        doings = (self._cell, self._worker, self._machine, self._parent)
        services = (self._service("prefect-server"), self._service("postgres"), self._cut)
        self.kinds: dict[str, Callable[[random.Random], str | None]] = dict(
            zip(self.KINDS, (*doings, *services), strict=True)
        )

    @classmethod
    @contextmanager
    def ready(cls, folder: Path) -> Iterator["Cluster"]:
        """Yield a stack that is up for the time of a block, its S3 store behind a wire."""
        stack = Stack(folder / "stack", scale={CELL: TRAINERS})
        wire = Proxy(stack.ports["s3"])
        temporary = stack.folder / "tmp"
        temporary.mkdir()
        behind = {"AWS_ENDPOINT_URL": f"http://127.0.0.1:{wire.port}"}
        stack.more = {**QUICK, **behind, "TMPDIR": str(temporary)}
        try:
            stack.up()
            os.environ.update(_settings(stack.client()))  # before Prefect is imported
            restarts = Restarts(stack)
            try:
                yield cls(stack, wire)
            finally:
                restarts.stop()
        finally:
            stack.down()
            for found in under(stack.folder / "home"):
                found.kill()
            wire.close()
            stack.remove()

    def start(self, study: dict[str, Any]) -> Any:
        self._missing = None
        return _patiently(lambda: _create(DEPLOYMENT, {**study, "executor": "work-pool"}))

    def state(self, run: Any) -> str | None:
        """Return the run's final state, `DEAD` if its process is gone, None while it runs or no
        server answers."""
        with suppress(Exception):
            kind = _state(run)
            if kind in ("COMPLETED", "FAILED", "CRASHED", "CANCELLED"):
                return kind
            if kind not in ("PENDING", "RUNNING") or self._flows(FLOW):
                self._missing = None
                return None
        self._missing = self._missing or time.monotonic()
        return "DEAD" if time.monotonic() - self._missing > GONE_S + CUT_S[1] else None

    def mend(self) -> None:
        self._wire.mend()
        for service in self._services(""):
            end = time.monotonic() + 180
            while time.monotonic() < end and not _healthy(service):
                time.sleep(1)

    def alive(self) -> list[str]:
        services = self._stack.pids
        found = [f for f in under(self._homes) if f.pid not in services]
        return [f"{f.pid} {f.command[:90]}" for f in found if not _is_check(f)]

    def folders(self) -> list[Path]:
        return [self._homes]

    def _services(self, name: str) -> list[Service]:
        known = self._stack.services.values()
        return [s for s in known if s.name.startswith(name) and s.name not in ("setup", "s3")]

    def _flows(self, name: str) -> list[Found]:
        """Return the processes of flow runs that workers of a service have started."""
        return [f for s in self._services(name) for f in self._runs(s) if ENGINE in f.command]

    def _runs(self, service: Service) -> list[Found]:
        """Return the processes that a service has started: flow runs, trainings and their
        children."""
        assert service.process is not None
        found = under(self._homes / service.name)
        return [f for f in found if f.pid != service.process.pid and not _is_check(f)]

    def _cell(self, rng: random.Random) -> str | None:
        found = [f for f in under(self._homes) if any(words in f.command for words in WORK)]
        return _killed(rng, found)

    def _parent(self, rng: random.Random) -> str | None:
        return _killed(rng, self._flows(FLOW))

    def _worker(self, rng: random.Random) -> str | None:
        """Kill a worker alone; the runs that it has started go on without it."""
        service = rng.choice([*self._services(FLOW), *self._services(CELL)])
        return service.name if service.murder() else None

    def _machine(self, rng: random.Random) -> str | None:
        """Kill a worker with everything that it has started, as when its container is killed."""
        all_of_them = [*self._services(FLOW), *self._services(CELL)]
        busy = [s for s in all_of_them if self._runs(s)]
        if not busy:
            return None
        service = rng.choice(busy)
        service.murder()
        killed = [found.kill() for found in self._runs(service)]
        return f"{service.name} and {sum(killed)} processes" if any(killed) else None

    def _service(self, name: str) -> Callable[[random.Random], str | None]:
        def kill(rng: random.Random) -> str | None:
            return name if self._stack.services[name].murder() else None

        return kill

    def _cut(self, rng: random.Random) -> str | None:
        """Cut the wire to the store from the first request that is lost."""
        seconds, before = rng.uniform(*CUT_S), self._wire.refused
        self._wire.cut()
        needed = wait(lambda: self._wire.refused > before, NEEDED_S)
        if needed:
            time.sleep(seconds)
        self._wire.mend()
        result = f"S3 for {seconds:.0f} s, {self._wire.refused - before} calls refused"
        return result if needed else None


def _killed(rng: random.Random, found: list[Found]) -> str | None:
    if not found:
        return None
    victim = rng.choice(found)
    return " ".join(victim.command.split()[1:4]) if victim.kill() else None


def _settings(client: dict[str, str]) -> dict[str, str]:
    return {n: v for n, v in client.items() if n.startswith(("PREFECT_", "AWS_", "DO_NOT"))}


def _create(name: str, study: dict[str, Any]) -> Any:
    from prefect.client.orchestration import get_client

    with get_client(sync_client=True) as client:
        known = client.read_deployment_by_name(name)
        return client.create_flow_run_from_deployment(known.id, parameters={"study": study}).id


def _state(run: Any) -> str:
    from prefect.client.orchestration import get_client

    with get_client(sync_client=True) as client:
        state = client.read_flow_run(run).state
    return "SCHEDULED" if state is None else state.type.value


def _patiently(call: Callable[[], Any]) -> Any:
    """Return the answer of a server that may still be starting."""
    for _ in range(60):
        with suppress(Exception):
            return call()
        time.sleep(2)
    return call()


def _healthy(service: Service) -> bool:
    with suppress(Exception):
        return service.healthy()
    return False


def _is_check(found: Found) -> bool:
    return "/health" in found.command or str(ROOT) == found.command
