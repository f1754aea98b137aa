"""Chaos: small studies whose processes, services, disk and wires are cut at random moments.

    python -m tools.chaos --trials 20 --seed 0         (make chaos)

Every trial disturbs a running study once, runs it again, and asks for tables that are byte for byte
those of an undisturbed run, no process and no temporary file left. Most trials are on the stack of
docker-compose.yml (tools/stack.py; its services start again by themselves, as `restart:
unless-stopped` does); some are one command on one machine whose store is a disk of 400 MB. Needs
Linux, PostgreSQL, and root for that disk. Exit code 1 if any trial fails.
"""

import argparse
import json
import random
import sys
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import Any

from tools.alone import Alone
from tools.cluster import Cluster
from tools.service import ROOT
from tools.trials import Bench, Tables, Trial, disturb, undisturbed

RESULTS = ROOT / "benchmarks" / "results" / "chaos.json"
LATEST = 0.85
"""Share of an undisturbed run's time before which it is disturbed."""
COLUMNS = ("number", "kind", "moment_s", "hit", "first", "again", "equal", "left", "seconds")


def plan(kinds: list[str], count: int, rng: random.Random) -> list[str]:
    """Kinds in random order, each as often as any other."""
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
    parser.add_argument("--folder", type=Path, default=None, help="for logs and data")
    wanted = parser.parse_args()
    rng = random.Random(wanted.seed)
    folder = wanted.folder or Path(tempfile.mkdtemp(prefix="robojackson-chaos-"))
    kinds = plan(wanted.kind or [*Cluster.KINDS, *Alone.KINDS], wanted.trials, rng)
    print(f"logs: {folder}", flush=True)
    trials: list[Trial] = []
    with benches(folder, kinds) as (known, expected):
        _say(COLUMNS)
        for number, kind in enumerate(kinds, 1):
            bench, seconds = known[kind]
            trial = Trial(number, kind, round(rng.uniform(0.02, LATEST) * seconds, 1))
            disturb(bench, trial, rng, expected)
            trials.append(trial)
            _say([_cell(getattr(trial, name)) for name in COLUMNS])
            _keep(wanted.seed, trials, {kind: s for kind, (_, s) in known.items()})
    bad = [trial.number for trial in trials if not trial.good]
    print(
        f"{len(trials) - len(bad)} of {len(trials)} trials good" + (f"; bad: {bad}" if bad else "")
    )
    sys.exit(bool(bad))


@contextmanager
def benches(
    folder: Path, kinds: list[str]
) -> Iterator[tuple[dict[str, tuple[Bench, float]], Tables]]:
    """Where each kind is tried, what an undisturbed run takes there, and its tables."""
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


def _keep(seed: int, trials: list[Trial], undisturbed_s: dict[str, float]) -> None:
    facts = {
        "command": f"python -m tools.chaos --trials {len(trials)} --seed {seed}",
        "good": sum(trial.good for trial in trials),
        "trials": [asdict(trial) for trial in trials],
        "undisturbed_s": {kind: round(s, 1) for kind, s in undisturbed_s.items()},
    }
    RESULTS.write_text(json.dumps(facts, indent=1) + "\n")


if __name__ == "__main__":
    main()
