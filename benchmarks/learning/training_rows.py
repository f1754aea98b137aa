"""Policies of the bundled dances and of the authors' clips, trained and evaluated: one cached row a
move and a seed, so that it may take several sittings.

A row's training is pinned to a core of its own and ended by the CPU minutes of its bar, or by the
control steps that these are worth, so that a faster machine learns no longer; on request by the
steps alone. A motion that the gate refuses is trained on anyway, and the row is marked.
"""

import os
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from queue import SimpleQueue

from benchmarks.learning.policies import MOVES, Folders, budget, must, reference_of, source_of
from benchmarks.learning.rows.row_references import record_reference

STEPS_A_MINUTE = 50_000
"""Control steps that a CPU minute of one core is worth."""


def train_and_judge(
    name: str,
    seed: int,
    minutes: float | None,
    folders: Folders,
    core: int,
    by_steps: bool = False,
) -> None:
    """Train one move with one seed and keep the rows of its evaluation; nothing if they exist."""
    kept = {s: folders.row(name, seed, s, minutes) for s in MOVES[name].horizons_s}
    if all(path.exists() for path in kept.values()):
        return
    work = folders.work / name
    reference, out = work / "reference.parquet", work / f"s{seed}{budget(minutes)}"
    spent = minutes or MOVES[name].cpu_minutes
    clock = () if by_steps else (f"cpu_minutes={spent}",)
    budgets = (*clock, f"steps={round(STEPS_A_MINUTE * spent)}")
    observed = f"track.observation={MOVES[name].observation}"
    options = ["--seed", seed, "--move", name, "--force"]
    options += [word for one in (*budgets, observed) for word in ("--set", one)]
    must("train", reference, "-o", out, *options, core=core)
    folders.rows.mkdir(parents=True, exist_ok=True)
    for seconds, path in kept.items():
        evaluated = out / f"evaluated-{seconds:g}s"
        policy = out / "policy.safetensors"
        must("evaluate", policy, reference, "-o", evaluated, "--seconds", seconds, core=core)
        part = path.with_suffix(".part")
        part.write_bytes((evaluated / "evaluations.parquet").read_bytes())
        record_reference(path, reference, folders)
        part.replace(path)


def policies(
    names: Iterable[str],
    seeds: Iterable[int],
    minutes: float | None,
    jobs: int,
    folders: Folders,
    by_steps: bool = False,
) -> None:
    """Train and evaluate all rows, `jobs` at a time, each on a core of its own; Ctrl-C keeps
    checkpoints.

    Args:
        minutes: Budget of every row, CPU minutes; the row's own when None.
        by_steps: Whether the steps that the budget is worth end a training, however long they take.
    """
    present = [name for name in names if source_of(MOVES[name]) is not None]
    for name in present:
        reference_of(name, folders)
    cores: SimpleQueue[int] = SimpleQueue()
    for core in sorted(os.sched_getaffinity(0))[:jobs]:
        cores.put(core)

    def row(name: str, seed: int) -> None:
        core = cores.get()
        try:
            train_and_judge(name, seed, minutes, folders, core, by_steps)
        finally:
            cores.put(core)

    jobs = max(1, cores.qsize())
    with ThreadPoolExecutor(jobs) as pool:
        work = [pool.submit(row, name, seed) for name in present for seed in seeds]
        try:
            for job in work:
                job.result()
        except BaseException:
            pool.shutdown(wait=True, cancel_futures=True)
            raise
