"""One machine without a server as a place where chaos is tried: `robojackson ablation` by hand.

Its store is a disk of its own (a tmpfs), so that it can be filled; mounting it takes root.
"""

import os
import random
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, ClassVar

import yaml

from storage.store import Store
from tools.stack.processes import under
from tools.stack.service import ROOT

DISK_MB = 400
HANGS_S = 120.0
"""After which a run on a full disk is killed."""
WORK = ("robojackson.cli train", "robojackson.cli evaluate")
CHUNK = b"\0" * (1 << 20)


class Alone:
    """A store on a small disk.

    Attributes:
        store: Store of the results.
        kinds: What can happen: does it and returns what it hit, or None if it cannot now.
    """

    KINDS: ClassVar = ("disk", "command", "training")

    def __init__(self, folder: Path) -> None:
        self._folder, self._home = folder, folder / "home"
        self._filler = folder / "store" / "filler"
        self._log = folder / "ablation.log"
        self.store = Store(folder / "store")
        self._run: subprocess.Popen[bytes] | None = None
        doings = (self._fill, self._command, self._training)
        self.kinds: dict[str, Callable[[random.Random], str | None]] = dict(
            zip(self.KINDS, doings, strict=True)
        )

    @classmethod
    @contextmanager
    def ready(cls, folder: Path) -> Iterator["Alone"]:
        """Yield a mounted disk for the time of a block.

        Raises:
            CalledProcessError: it cannot be mounted.
        """
        place = folder / "alone"
        for name in ("home", "store", "tmp"):
            (place / name).mkdir(parents=True)
        disk = str(place / "store")
        options = ["-t", "tmpfs", "-o", f"size={DISK_MB}m", "tmpfs", disk]
        subprocess.run(["mount", *options], check=True)
        try:
            yield cls(place)
        finally:
            for found in under(place / "home"):
                found.kill()
            subprocess.run(["umount", "--lazy", disk], check=True)

    def start(self, study: dict[str, Any]) -> Any:
        expected = self._folder / "study.yaml"
        expected.write_text(yaml.safe_dump(study))
        command = [sys.executable, "-m", "robojackson", "ablation", str(expected), "--json"]
        with self._log.open("ab") as out:
            self._run = subprocess.Popen(
                command, env=self._environment(), cwd=ROOT, stdout=out, stderr=out
            )
        return self._run

    def state(self, run: Any) -> str | None:
        code = run.poll()
        if code is None:
            return None
        return "COMPLETED" if code == 0 else f"exit {code}"

    def mend(self) -> None:
        self._filler.unlink(missing_ok=True)

    def alive(self) -> list[str]:
        return [f"{f.pid} {f.command[:90]}" for f in under(self._home)]

    def folders(self) -> list[Path]:
        return [self._folder]

    def _environment(self) -> dict[str, str]:
        path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
        ours = {"HOME": str(self._home), "TMPDIR": str(self._folder / "tmp")}
        ours |= {"PYTHONPATH": str(ROOT), "ROBOJACKSON_STORE": self.store.root}
        host = {k: os.environ[k] for k in ("LANG", "LD_LIBRARY_PATH") if k in os.environ}
        return {**host, **ours, "PATH": path, "OMP_NUM_THREADS": "1"}

    def _fill(self, rng: random.Random) -> str | None:
        """Fill the disk; whoever hangs on it for two minutes is killed.

        A run that ends well has had no need of the disk.
        """
        assert self._run is not None
        with self._filler.open("wb", buffering=0) as file, suppress(OSError):
            while True:
                file.write(CHUNK)
        try:
            return "the disk" if self._run.wait(HANGS_S) else None
        except subprocess.TimeoutExpired:
            self._run.send_signal(signal.SIGKILL)
            return "the disk; the run hung and was killed"

    def _command(self, rng: random.Random) -> str | None:
        assert self._run is not None
        self._run.send_signal(signal.SIGKILL)
        return "robojackson ablation" if self._run.wait() == -signal.SIGKILL else None

    def _training(self, rng: random.Random) -> str | None:
        found = [f for f in under(self._home) if any(words in f.command for words in WORK)]
        if not found:
            return None
        victim = rng.choice(found)
        return " ".join(victim.command.split()[1:4]) if victim.kill() else None
