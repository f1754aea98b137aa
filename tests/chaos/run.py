"""Chaos: small studies whose processes, services, disk and wires are cut at random moments.

    python -m tests.chaos.run --trials 20 --seed 0                          (make chaos)
    python -m tests.chaos.run --trials 20 --seed 0 --first 8 --out FILE     goes on where FILE ends

Every trial disturbs a running study once, runs it again, and requires tables that are byte for byte
those of an undisturbed run, no process and no temporary file left. Most trials are on the stack of
docker-compose.yml (tools/stack/compose_stack.py; its services start again by themselves, as
`restart: unless-stopped` does); some are one command on one machine whose store is a disk of
400 MB. Needs Linux, PostgreSQL, and root for that disk. Exit code 1 if any trial fails.
"""

import argparse
import json
import random
import signal
import sys
import tempfile
import time
from collections.abc import Iterable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

from tests.chaos.one_machine import Alone
from tests.chaos.stack_cluster import Cluster
from tests.chaos.trial import Bench, Tables, Trial, disturb, undisturbed
from tools.stack.service import ROOT

RESULTS = ROOT / "benchmarks" / "results" / "chaos.json"
LATEST = 0.85
"""Share of an undisturbed run's time before which it is disturbed."""
COLUMNS = tuple(field.name for field in fields(Trial))


def plan(kinds: list[str], count: int, rng: random.Random) -> list[str]:
    """Return kinds in random order, each as often as any other."""
    drawn: list[str] = []
    while len(drawn) < count:
        drawn += rng.sample(kinds, len(kinds))
    return drawn[:count]


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--trials", type=int, default=20)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--kind", action="append", help="only this kind; may be repeated")
    parser.add_argument("--first", type=int, default=1, help="number of the trial to begin with")
    parser.add_argument("--folder", type=Path, default=None, help="for logs and data")
    parser.add_argument("--out", type=Path, default=RESULTS, help="what has been shown, as JSON")
    parser.add_argument("--hold", type=Path, help="no trial begins while this file is there")
    options = parser.parse_args()
    for how in (signal.SIGINT, signal.SIGTERM):  # each of the two ends all that was started
        signal.signal(how, signal.default_int_handler)
    folder = options.folder or Path(tempfile.mkdtemp(prefix="robojackson-chaos-"))
    given = options.kind or [*Cluster.KINDS, *Alone.KINDS]
    kinds = plan(given, options.trials, random.Random(options.seed))
    coming = list(enumerate(kinds, 1))[options.first - 1 :]
    print(f"logs: {folder}", flush=True)
    trials = known_trials(options.out)[: options.first - 1] if options.first > 1 else []
    with benches(folder, [kind for _, kind in coming]) as (known, expected):
        _say(COLUMNS)
        for number, kind in coming:
            _hold(options.hold)
            trials.append(tried(number, kind, options.seed, *known[kind], expected))
            _say([_cell(getattr(trials[-1], name)) for name in COLUMNS])
            facts = {"undisturbed_s": {kind: round(s, 1) for kind, (_, s) in known.items()}}
            _keep(options.out, f"--trials {options.trials} --seed {options.seed}", trials, facts)
    bad = [trial.number for trial in trials if not trial.good]
    print(
        f"{len(trials) - len(bad)} of {len(trials)} trials good" + (f"; bad: {bad}" if bad else "")
    )
    sys.exit(bool(bad))


def tried(
    number: int, kind: str, seed: int, bench: Bench, seconds: float, expected: Tables
) -> Trial:
    """Run one trial, whose random numbers depend on its number alone, so that it can be repeated
    alone."""
    rng = random.Random(f"{seed}-{number}")
    trial = Trial(number, kind, round(rng.uniform(0.02, LATEST) * seconds, 1))
    disturb(bench, trial, rng, expected)
    return trial


def known_trials(file: Path) -> list[Trial]:
    """Return the trials that a file lists."""
    answer = json.loads(file.read_text())["trials"]
    return [Trial(**facts) for facts in answer]


@contextmanager
def benches(
    folder: Path, kinds: list[str]
) -> Iterator[tuple[dict[str, tuple[Bench, float]], Tables]]:
    """Yield, by kind, where it is tried, the seconds of an undisturbed run there, and its
    tables."""
    known: dict[str, tuple[Bench, float]] = {}
    seen: list[Tables] = []
    with ExitStack() as stack:
        places: tuple[Any, ...] = (Cluster, Alone)
        for place in places:
            if not set(place.KINDS) & set(kinds):
                continue
            bench: Bench = stack.enter_context(place.ready(folder))
            made, seconds = undisturbed(bench)
            seen.append(made)
            print(f"undisturbed, {place.__name__.lower()}: {seconds:.0f} s, {len(made)} tables")
            known |= dict.fromkeys(place.KINDS, (bench, seconds))
        if any(made != seen[0] for made in seen):
            raise SystemExit("one machine and the cluster write different tables")
        yield known, seen[0]


def _say(words: Iterable[object]) -> None:
    print(" | ".join(map(str, words)), flush=True)


def _cell(value: object) -> str:
    if isinstance(value, float):
        return f"{value:.0f}"
    return ", ".join(value) if isinstance(value, list) else str(value)


def _hold(file: Path | None) -> None:
    while file is not None and file.exists():
        time.sleep(1.0)


def _keep(file: Path, words: str, trials: list[Trial], facts: dict[str, Any]) -> None:
    record = {
        "command": f"python -m tests.chaos.run {words}",
        "good": sum(trial.good for trial in trials),
        "trials": [asdict(trial) for trial in trials],
        **facts,
    }
    file.write_text(json.dumps(record, indent=1) + "\n")


if __name__ == "__main__":
    main()
