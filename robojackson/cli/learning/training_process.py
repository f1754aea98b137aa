"""The training process: reads a reference motion, trains, writes tables and policy into one folder.

A separate process without Prefect. It can be made to end with the process that started it, and it
holds a lock on its folder, so that no two trainings share a checkpoint.
"""

import json
import logging
import math
import os
import signal
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from robojackson.cli import cards, console
from robojackson.cli.learning.training_request import SECTION, requested
from robojackson.cli.lifetime.interruption import STOPS, UnsavedFlag, is_guarded, with_option
from robojackson.cli.lifetime.parent_death import end_with_parent

if TYPE_CHECKING:
    from robojackson.api.trained_policy import TrainedPolicy

log = logging.getLogger(__name__)

USUAL_MINUTES = 10.0
"""Advice for a training that ended before its first update."""
RECENT = 100
"""Number of last episodes that describe a training."""
PROGRESS = "progress.json"
"""Progress of a training, in its folder."""


def train(
    reference: Path,
    out: Path,
    setup: str | None,
    overrides: Mapping[str, object],
    run_id: str = "",
    move: str = "",
    force: bool = False,
    robot: str | None = None,
    config: str | None = None,
) -> dict[str, Any]:
    """Train until the budget is used up; the same call resumes after an interruption.

    Args:
        setup: Name in configs/setups such as `pretrain`, or the path of a training configuration.
        force: Train on a motion that the gate refuses, too.
        robot: Name or file of the motion's robot; None reads it from the motion.
        config: Name or path of a pipeline's configuration; without a setup its section `train` and
            its `gate` apply.
    Raises:
        BadConfiguration: a wrong key or value; a setup beside a configuration.
        Interrupted: Ctrl-C or SIGTERM, after a checkpoint was written.
        RejectedReference: the robot cannot follow the motion, by the motion's own score card.
    """
    from robojackson.api.policy_training import train_policy
    from robojackson.rl.checkpoint_folder import newest_checkpoint
    from robojackson.rl.training_hooks import Hooks

    request = requested(config, setup, overrides)
    stop = _StopRequest(out)
    with stop.listening(), console.ticker() as write_line:
        hooks = Hooks(
            progress=partial(_report_progress, out=out, write_line=write_line),
            on_learning=stop.mark_unsaved,
            stop=stop,
            audited=lambda audit: write_line(format_reward_audit(audit)) if audit else None,
        )
        try:
            trained = train_policy(
                reference, robot, config=request.train, setup=request.setup, out=out, move=move,
                run_id=run_id, force=force or not request.gate, hooks=hooks,
            )  # fmt: skip
        except KeyboardInterrupt:
            there = newest_checkpoint(out)
            kept = f"the checkpoint is in {out}; resume" if there else "nothing learnt yet; again"
            raise console.Interrupted(f"{kept}: {console.same_command()}") from None
    return _answer(trained, reference, out / "policy.safetensors", robot)


def _answer(
    trained: "TrainedPolicy", reference: Path, policy: Path, robot: str | None
) -> dict[str, Any]:
    """Return the command's answer about a finished training."""
    from robojackson.rl.config.train_config import BUDGETS

    config = trained.config
    survived = [row["survived_s"] for row in trained.episodes[-RECENT:]]
    verdict = cards.train_verdict(trained.updates, trained.steps, survived)
    following = cards.command_line("evaluate", policy, reference, *cards.of_robot(robot))
    if verdict["kind"] == "untrained":
        minutes = f"{USUAL_MINUTES:g}"
        budgets = (*BUDGETS, *(f"{SECTION}{name}" for name in BUDGETS))
        following = with_option("--minutes", minutes, without=("--steps",), unset=budgets)
    return {
        "policy": str(policy),
        "reference": str(reference),
        "mode": config.mode,
        "trainer": config.trainer,
        "seed": config.seed,
        "reward_audit": trained.reward_audit,
        "steps": trained.steps,
        "updates": trained.updates,
        "seconds": trained.seconds,
        "stopped": trained.stopped,
        "episodes": len(trained.episodes),
        "verdict": verdict,
        "next": following,
    }


def status(row: Mapping[str, float]) -> str:
    """Return a progress row as one line."""
    minutes, seconds = divmod(int(row["seconds_left"]), 60)
    survived, error = _number(row["survived_s"], 2), _number(100 * row["site_error_m"], 1)
    return (
        f"{int(row['steps']):>9,} steps  {row['steps_per_s']:,.0f}/s  "
        f"survived {survived} s  error {error} cm  "
        f"return {_number(row['episode_return'], 1)}  {minutes}:{seconds:02d} left"
    )


def format_reward_audit(found: Mapping[str, Mapping[str, float]]) -> str:
    """Return the reward of bodies that do not dance, as one line."""
    parts = []
    for reading, of in found.items():
        shares = (f"{name} {100 * of[name]:.0f} %" for name in of if name != "perfect_step")
        parts.append(f"({reading}) {', '.join(shares)}")
    return f"of a perfect dance's reward: {'; '.join(parts)}"


def _report_progress(
    row: Mapping[str, float], out: Path, write_line: Callable[[str], None]
) -> None:
    """Write the progress on stderr and into the folder, where other processes read it."""
    write_line(status(row))
    finite = {k: v if math.isfinite(v) else None for k, v in row.items()}
    whole = out / f".{PROGRESS}"
    with suppress(OSError):
        whole.write_text(json.dumps(finite, default=float))
        whole.replace(out / PROGRESS)


def _number(value: float, digits: int) -> str:
    """Return a number as text; a dash before there is a figure."""
    return f"{value:.{digits}f}" if math.isfinite(value) else "-"


def end_with(parent: int) -> None:
    """Ask the kernel to end this process when the one that started it ends (Linux only)."""
    if not end_with_parent(parent):
        raise console.Interrupted("the process that started this training is gone")


class _StopRequest:
    """Whether the training should stop, and whether it has unsaved learning.

    Attributes:
        unsaved: The flag that the supervisor of the command waits for.
    """

    def __init__(self, out: Path) -> None:
        self._out, self._received = out, False
        self.unsaved = UnsavedFlag()

    def __call__(self) -> bool:
        return self._received

    @contextmanager
    def listening(self) -> Iterator[None]:
        """Receive Ctrl-C and SIGTERM inside; restore handlers and clear the flag afterwards."""
        before = [(number, signal.signal(number, self.receive)) for number in STOPS]
        try:
            yield
        finally:
            self.unsaved.clear()
            for number, handler in before:
                signal.signal(number, handler)

    def mark_unsaved(self) -> None:
        """Set the flag; in a stopping training do nothing, since new learning must not delay its
        end."""
        if not self._received:
            self.unsaved.set()

    def receive(self, number: int, frame: object) -> None:
        """Handle a signal; without a supervisor a second signal ends the training."""
        if not self._received:
            self._received = True
            checkpoint = f", with a checkpoint in {self._out}" if self.unsaved.is_set else ""
            # Not by the log: the signal may arrive while a line is written there.
            os.write(2, f"stopping after this round of updates{checkpoint}\n".encode())
        elif not is_guarded():
            raise KeyboardInterrupt
