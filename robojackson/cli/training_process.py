"""The training process: reads a reference motion, trains, keeps tables and policy in one folder.

A process of its own, with no Prefect in memory. It can be told to die with the process that started
it, and it holds a lock on its folder, so that no two trainings share a checkpoint.
"""

import json
import math
import os
import signal
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from robojackson.cli import console, stages
from robojackson.cli.lifetime.interruption import STOPS, UnsavedFlag, is_guarded
from robojackson.cli.lifetime.orphans import end_with_parent
from robojackson.pipeline.file_tree import FileTree
from robojackson.pipeline.folder_lock import locked
from robojackson.pipeline.record_log import RecordLog
from robojackson.pipeline.table_schemas import EPISODE_RECORD
from robojackson.pipeline.yaml_loader import load

if TYPE_CHECKING:
    from robojackson.rl.config.train_config import TrainConfig

PROGRESS = "progress.json"
"""How far a training is, in its folder."""
DEFAULT_MINUTES = 9.0
"""Wall time of a training for which no budget is given."""
SETUPS = {
    (False, False): "scratch",
    (True, False): "pretrain",
    (True, True): "curiosity",
    (False, True): "scratch-curiosity",
}
"""What a configuration is called that no file gave: by whether it starts from networks, and whether
curiosity is paid."""
SAVE_SECONDS = 20.0
"""Between two writes of the table of episodes."""


def train(
    reference: Path,
    out: Path,
    setup: str | None,
    overrides: Mapping[str, Any],
    run_id: str = "",
    move: str = "",
    force: bool = False,
) -> dict[str, Any]:
    """Train until the budget is used up; the same call goes on after an interruption.

    Args:
        setup: `pretrain` and the like of configs/setups, or the path of a training configuration.
        force: Train on a motion that the gate refuses, too.
    Raises:
        Interrupted: Ctrl-C or SIGTERM, after a checkpoint was written.
        RejectedReference: the motion's own score card says that the robot cannot follow it.
    """
    from robojackson.motion.reference_motion import ReferenceMotion
    from robojackson.retarget.scorecard_gate import check, scorecard_record
    from robojackson.rl.config.train_config import TrainConfig
    from robojackson.rl.evaluation.reward_audit import audit_both_readings, audit_record
    from robojackson.rl.modes.paper_mode import require_trainable
    from robojackson.rl.training import Hooks, train_policy
    from robojackson.rl.training_run import newest_checkpoint

    config = _with_budget(load(TrainConfig, _setup(setup), overrides))
    motion = stages.read_table(ReferenceMotion, reference)
    robot = stages.robot_of(motion)
    require_trainable(robot)
    if not force:
        check(scorecard_record(motion))
    stop = _StopRequest(out)
    common = _common(config, move or stages.move_of(reference), setup, run_id)
    with (
        stop.listening(),
        stages.results_in(out) as files,
        locked(out),
        console.ticker() as tell,
    ):
        rows = _EpisodeLog(files, common, resumes=newest_checkpoint(out) is not None)
        try:
            asked = audit_record(audit_both_readings(robot, motion, config.environment))
            if asked:
                tell(format_reward_audit(asked))
            told_of = partial(_report_progress, out=out, tell=tell)
            hooks = Hooks(
                told_of, rows.add, stop.mark_unsaved, rows.save, stop, setup=common["setup"]
            )
            result = train_policy(motion, robot, config, out, hooks)
        except KeyboardInterrupt:
            there = newest_checkpoint(out)
            kept = f"the checkpoint is in {out}; resume" if there else "nothing learnt yet; again"
            raise console.Interrupted(f"{kept}: {console.same_command()}") from None
        finally:
            if len(rows):
                rows.save()
        if not len(rows):
            rows.save()
    return {
        "policy": str(result.policy),
        "reference": str(reference),
        "mode": config.mode,
        "trainer": config.trainer,
        "seed": config.seed,
        "reward_audit": asked,
        "steps": result.steps,
        "updates": result.updates,
        "seconds": result.seconds,
        "stopped": result.stopped,
        "episodes": len(rows),
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


def format_reward_audit(found: Mapping[str, Mapping[str, float]]) -> str:
    """What the reward pays to bodies that do not dance, as one line."""
    parts = []
    for reading, of in found.items():
        shares = (f"{name} {100 * of[name]:.0f} %" for name in of if name != "perfect_step")
        parts.append(f"({reading}) {', '.join(shares)}")
    return f"of a perfect dance's reward: {'; '.join(parts)}"


def _report_progress(row: Mapping[str, float], out: Path, tell: Callable[[str], None]) -> None:
    """Say how far it is, and leave it for whoever watches the folder."""
    tell(status(row))
    finite = {k: v if math.isfinite(v) else None for k, v in row.items()}
    whole = out / f".{PROGRESS}"
    with suppress(OSError):
        whole.write_text(json.dumps(finite, default=float))
        whole.replace(out / PROGRESS)


def _number(value: float, digits: int) -> str:
    """A dash before there is a figure."""
    return f"{value:.{digits}f}" if math.isfinite(value) else "-"


def end_with(parent: int) -> None:
    """Ask the kernel to end this process when the one that started it ends (Linux only)."""
    if not end_with_parent(parent):
        raise console.Interrupted("the process that started this training is gone")


class _StopRequest:
    """Whether the training is to stop, and whether it has learning to save when it does.

    Attributes:
        unsaved: The flag for which the supervisor of the command waits.
    """

    def __init__(self, out: Path) -> None:
        self._out, self._received = out, False
        self.unsaved = UnsavedFlag()

    def __call__(self) -> bool:
        return self._received

    @contextmanager
    def listening(self) -> Iterator[None]:
        """Receive Ctrl-C and SIGTERM inside; afterwards restore handlers and clear the flag."""
        before = [(number, signal.signal(number, self.receive)) for number in STOPS]
        try:
            yield
        finally:
            self.unsaved.clear()
            for number, handler in before:
                signal.signal(number, handler)

    def mark_unsaved(self) -> None:
        """Set the flag; a training that is already to stop does not delay its end by what it has
        only just begun to learn."""
        if not self._received:
            self.unsaved.set()

    def receive(self, number: int, frame: object) -> None:
        """Handle a signal; a second one ends a training that has no supervisor to do so."""
        if not self._received:
            self._received = True
            checkpoint = f", with a checkpoint in {self._out}" if self.unsaved.is_set else ""
            # Not by the log: the signal may come while a line is being written there.
            os.write(2, f"stopping after this round of updates{checkpoint}\n".encode())
        elif not is_guarded():
            raise KeyboardInterrupt


class _EpisodeLog:
    """episodes.parquet, written now and then while rows come in."""

    def __init__(self, files: FileTree, common: Mapping[str, Any], resumes: bool) -> None:
        self._log = RecordLog(files, "episodes.parquet", EPISODE_RECORD, common, resumes)
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


def _setup(name: str | None) -> str | None:
    """A bare name is one of configs/setups."""
    bare = name is not None and not {"/", "."} & set(name)
    return f"setups/{name}" if bare else name


def _with_budget(config: "TrainConfig") -> "TrainConfig":
    """With the usual wall time where nothing ends the training."""
    return config if config.has_budget else replace(config, minutes=DEFAULT_MINUTES)


def _common(config: "TrainConfig", move: str, setup: str | None, run_id: str) -> dict[str, Any]:
    usual = SETUPS[config.start != "scratch", config.curiosity != "off"]
    labels = stages.labels_of(move, Path(setup).stem if setup else usual, config.seed)
    return labels | ({"run_id": run_id} if run_id else {})
