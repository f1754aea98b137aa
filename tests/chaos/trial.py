"""One trial of chaos: a study is disturbed, run again, and compared with an undisturbed one."""

import random
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

from robojackson.files.local_folder import TEMPORARY
from storage import study_tables
from storage.store import SCRATCH, Store

STUDY: dict[str, Any] = {
    "name": "chaos",
    "moves": ["hip_shake"],
    "setups": ["scratch", "pretrain"],
    "seeds": [0],
    "trainer": "sb3",
    "steps": 192,
    "pipeline": "smoke",
    "train": {"tqc.warmup": 64, "tqc.batch": 32, "checkpoint_seconds": 1.0},
}
"""As small as a study can be whose trainings save what they have learnt and go on from it."""
NEXT = {**STUDY, "name": "next", "seeds": [1]}
"""Other cells, none of them cached: every machine has to do something again."""
MADE = ("train", "evaluate", "studies", study_tables.FOLDER)
RECORDS = ("records/train_policy", "records/evaluate_policy")
"""What a run makes besides the motions, and the records of its stages."""
QUIET_S, PATIENCE_S = 4.0, 1800.0
TRIES = 3
Tables = dict[str, bytes]


class Bench(Protocol):
    """Where a study runs: a stack with its workers, or one command on one machine."""

    store: Store
    kinds: dict[str, Callable[[random.Random], str | None]]

    def start(self, study: dict[str, Any]) -> Any:
        """Begin a study; return the argument of `state`."""

    def state(self, run: Any) -> str | None:
        """Return how it ended, or None while it runs."""

    def mend(self) -> None:
        """Make everything work again after a disturbance."""

    def alive(self) -> list[str]:
        """Return the processes that belong to a run."""

    def folders(self) -> list[Path]:
        """Return the folders in which the machines have files of their own."""


@dataclass
class Trial:
    """What one disturbance did.

    Attributes:
        number, kind: Which trial, what was disturbed.
        moment_s: When, after the start of the run, seconds.
        hit: What it hit; empty if the run was over before.
        first, again: How the disturbed run and the one after it ended.
        runs: How many runs came after it: two if a machine had kept something.
        equal: Whether the tables are those of an undisturbed run, byte for byte.
        left: Processes and files that no one owns.
        seconds: All of it.
    """

    number: int
    kind: str
    moment_s: float
    hit: str = ""
    first: str = ""
    again: str = ""
    runs: int = 1
    equal: bool = False
    left: list[str] = field(default_factory=list)
    seconds: float = 0.0

    @property
    def good(self) -> bool:
        return self.again == "COMPLETED" and self.equal and not self.left and bool(self.hit)


def undisturbed(bench: Bench) -> tuple[Tables, float]:
    """Return the tables of an undisturbed run and its duration, seconds.

    Raises:
        RuntimeError: it did not end well.
    """
    run_to_end(bench)  # makes the motions, which no trial makes again
    wipe(bench.store)
    began = time.monotonic()
    state = run_to_end(bench)
    if state != "COMPLETED":
        raise RuntimeError(f"an undisturbed run ended {state}")
    return tables(bench.store), time.monotonic() - began


def disturb(bench: Bench, trial: Trial, rng: random.Random, expected: Tables) -> None:
    """Fill in what a trial shows; a run that was over too early is begun again, and hit earlier."""
    began = time.monotonic()
    for _ in range(TRIES):
        wipe(bench.store)
        run = bench.start(STUDY)
        trial.hit = _hit(bench, trial, rng, run)
        if trial.hit:
            break
        _ended(bench, run)
        bench.mend()
        trial.moment_s = round(trial.moment_s / 2, 1)
    trial.first = _ended(bench, run)
    bench.mend()
    trial.again = run_to_end(bench)
    quiet(bench)
    if leftovers(bench):  # a machine takes away what is left when it has its next cell
        run_to_end(bench, NEXT)
        quiet(bench)
        trial.runs += 1
    trial.equal = tables(bench.store) == expected
    trial.left = [*bench.alive(), *leftovers(bench)]
    trial.seconds = time.monotonic() - began


def _hit(bench: Bench, trial: Trial, rng: random.Random, run: Any) -> str:
    """Disturb at the moment, or as soon as there is something to disturb; what was hit."""
    end = time.monotonic() + trial.moment_s
    while time.monotonic() < end and not bench.state(run):
        time.sleep(1.0)
    while not bench.state(run):
        if hit := bench.kinds[trial.kind](rng):
            return hit
        time.sleep(0.5)
    return ""


def run_to_end(bench: Bench, study: dict[str, Any] = STUDY) -> str:
    """Start a study and wait; how it ended."""
    return _ended(bench, bench.start(study))


def _ended(bench: Bench, run: Any) -> str:
    return str(wait(lambda: bench.state(run), PATIENCE_S))


def wait(question: Callable[[], Any], seconds: float) -> Any:
    """Return the first answer that is not empty, or None."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if answer := question():
            return answer
        time.sleep(1.0)
    return None


def quiet(bench: Bench) -> None:
    """Return when no process of a run has been there for some seconds."""
    end, since = time.monotonic() + PATIENCE_S, time.monotonic()
    while time.monotonic() - since < QUIET_S and time.monotonic() < end:
        if bench.alive():
            since = time.monotonic()
        time.sleep(0.3)


def wipe(store: Store) -> None:
    """Take away everything that cells make, so that nothing of it is cached."""
    for prefix in (*MADE, *RECORDS):
        for key in store.list(prefix):
            store.remove(key)


def tables(store: Store) -> Tables:
    """Return the bytes of the tables of the study, by key."""
    found = {}
    for table in study_tables.TABLES:
        for key in store.list(f"{study_tables.FOLDER}/{table}/study={STUDY['name']}"):
            found[key] = store.read(key)
    return found


def leftovers(bench: Bench) -> list[str]:
    """Return half-written files, scratch folders and the work of finished cells."""
    return [str(path) for folder in bench.folders() for path in leftovers_in(folder)]


def leftovers_in(folder: Path) -> list[Path]:
    """Return the leftovers of one folder."""
    with suppress(FileNotFoundError):  # what goes away meanwhile is not left
        parts = list(folder.rglob(f"{TEMPORARY}*"))
        work = [path for path in folder.rglob("work/*") if path.name != SCRATCH]
        scratch = list(folder.rglob(f"work/{SCRATCH}/*"))
        return [*parts, *work, *scratch]
    return leftovers_in(folder)
