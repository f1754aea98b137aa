"""The training process: reads a reference motion, trains, keeps tables and policy in one folder.

A process of its own, with no Prefect in memory. It can be told to die with the process that started
it, and it holds a lock on its folder, so that no two trainings share a checkpoint.
"""

import ctypes
import math
import os
import signal
import sys
import time
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from configs.loader import load
from flows import console, single
from storage.catalogue import safe_name
from storage.lock import locked
from storage.records import RecordLog
from storage.schemas import EPISODE_RECORD
from storage.store import Store

if TYPE_CHECKING:
    from robojackson.rl.config import TrainConfig

DIE_WITH_PARENT = 1
"""PR_SET_PDEATHSIG of prctl(2)."""
USUAL_MINUTES = 9.0
"""Wall time of a training for which no budget is given."""
SAVE_SECONDS = 20.0
"""Between two writes of the table of episodes."""


def train(
    reference: Path,
    out: Path,
    setup: str | None,
    overrides: Mapping[str, Any],
    run_id: str = "",
    move: str = "",
) -> dict[str, Any]:
    """Train until the budget is used up; the same call goes on after an interruption.

    Raises:
        Interrupted: Ctrl-C or SIGTERM, after a checkpoint was written.
    """
    from robojackson.motion.reference import ReferenceMotion
    from robojackson.rl.config import TrainConfig
    from robojackson.rl.train import train as learn

    config = _budgeted(load(TrainConfig, setup, overrides))
    motion = single.read_table(ReferenceMotion, reference)
    robot = single.robot_of(motion)
    for wish in (signal.SIGINT, signal.SIGTERM):
        signal.signal(wish, signal.default_int_handler)
    with single.results_in(out) as store, locked(out), console.ticker() as tell:
        log = _EpisodeLog(store, _common(config, move or _move_of(reference), setup, run_id))
        try:
            result = learn(
                motion, robot, config, out, progress=lambda row: tell(status(row)), sink=log.add
            )
        except KeyboardInterrupt:
            raise console.Interrupted(
                f"the checkpoint is in {out}; resume: {console.same_command()}"
            ) from None
        finally:
            if len(log):
                log.save()
        if not len(log):
            log.save()
    return {
        "policy": str(result.policy),
        "reference": str(reference),
        "trainer": config.trainer,
        "seed": config.seed,
        "steps": result.steps,
        "updates": result.updates,
        "seconds": result.seconds,
        "stopped": result.stopped,
        "episodes": len(log),
    }


def status(row: Mapping[str, float]) -> str:
    """A progress row as one line."""
    minutes, seconds = divmod(int(row["seconds_left"]), 60)
    survived, error = _number(row["survived_s"], 2), _number(100 * row["site_error_m"], 1)
    return (
        f"{int(row['steps']):>9,} steps  {row['steps_per_s']:,.0f}/s  "
        f"survived {survived} s  error {error} cm  "
        f"return {_number(row['episode_return'], 1)}  {minutes}:{seconds:02d} left"
    )


def _number(value: float, digits: int) -> str:
    """A dash before there is a figure."""
    return f"{value:.{digits}f}" if math.isfinite(value) else "-"


def die_with(parent: int) -> None:
    """Ask the kernel to end this process when the one that started it ends (Linux only)."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(DIE_WITH_PARENT, signal.SIGKILL, 0, 0, 0)
    if os.getppid() != parent:
        raise console.Interrupted("the process that started this training is gone")


class _EpisodeLog:
    """episodes.parquet, written now and then while rows come in."""

    def __init__(self, store: Store, common: Mapping[str, Any]) -> None:
        self._log = RecordLog(store, "episodes.parquet", EPISODE_RECORD, common)
        self._saved = time.monotonic()

    def __len__(self) -> int:
        return len(self._log)

    def add(self, rows: list[dict[str, float]]) -> None:
        self._log.append(rows)
        if time.monotonic() - self._saved > SAVE_SECONDS:
            self.save()

    def save(self) -> None:
        self._log.save()
        self._saved = time.monotonic()


def _budgeted(config: "TrainConfig") -> "TrainConfig":
    """With the usual wall time where nothing ends the training."""
    given = config.steps is not None or config.minutes is not None
    return config if given else replace(config, minutes=USUAL_MINUTES)


def _common(config: "TrainConfig", move: str, setup: str | None, run_id: str) -> dict[str, Any]:
    name = Path(setup).stem if setup else "scratch"
    move, name = safe_name(move), safe_name(name)
    labels = {"run_id": run_id or f"{move}-{name}-s{config.seed}", "move": move, "setup": name}
    return {**labels, "seed": config.seed}


def _move_of(reference: Path) -> str:
    """A reference motion is called by its folder when its own name says nothing."""
    path = reference.absolute()
    return path.parent.name if path.stem == "reference" else path.stem
