"""One progress bar for a whole dance: the stage, its rate, and the time left in all.

On a terminal it takes the place of Prefect's lines about tasks, of which warnings stay; in a file
or a pipe there is no bar and all lines are written.
"""

import json
import logging
import os
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn

from flows.video_pass.pass_progress import listening

HANDLERS = ("CONSOLE", "CONSOLE_FLOW_RUNS", "CONSOLE_TASK_RUNS")
"""Prefect's, that write to the terminal."""
REFRESH_S = 0.5
TRAININGS = "work/train-*/progress.json"
"""What trainings leave of how far they are, in a store on this machine."""
TASK_LOG, FLOW_LOG = "prefect.task_runs", "prefect.flow_runs"


def quiet_prefect() -> None:
    """Leave Prefect's warnings on a terminal; call it before Prefect is imported."""
    if sys.stderr.isatty():
        for name in HANDLERS:
            os.environ.setdefault(f"PREFECT_LOGGING_HANDLERS_{name}_LEVEL", "WARNING")


@contextmanager
def dance_bar(minutes: float, store: Path) -> Iterator[None]:
    """Show the progress of the pass that runs inside, on a terminal.

    Args:
        minutes: Budget of the whole pass.
        store: Folder in which trainings work.
    """
    console = Console(stderr=True)
    if not console.is_terminal:
        yield
        return
    columns = (TextColumn("{task.description}"), BarColumn(), TextColumn("{task.fields[note]}"))
    with Progress(*columns, console=console, transient=True) as progress:
        task = progress.add_task("starting", total=60 * minutes, note="")
        over = threading.Event()
        watch = _Watch(progress, task, minutes, store, over)
        threading.Thread(target=watch.run, daemon=True).start()
        try:
            with listening(watch.at), _budget_printed(progress):
                yield
        finally:
            over.set()


@contextmanager
def _budget_printed(progress: Progress) -> Iterator[None]:
    """Print above the bar what training gets of the minutes, and where a tracker's dance is to be
    seen; Prefect's lines of it are hidden."""
    notes, loggers = _Budget(progress), [logging.getLogger(name) for name in (TASK_LOG, FLOW_LOG)]
    for each in loggers:
        each.addHandler(notes)
    try:
        yield
    finally:
        for each in loggers:
            each.removeHandler(notes)


class _Budget(logging.Handler):
    """Prints these lines, and no other."""

    def __init__(self, progress: Progress) -> None:
        super().__init__(logging.INFO)
        self._progress = progress

    def emit(self, record: logging.LogRecord) -> None:
        """Print the record if it is one of them."""
        from flows.video_pass.tracker_stages import FIRST_PAGE
        from tasks.train_policy import BUDGET

        if record.msg in (BUDGET, FIRST_PAGE):
            self._progress.console.print(record.getMessage(), highlight=False)


class _Watch:
    """Moves the bar with the clock.

    Attributes:
        stage: Current stage of the pass.
    """

    def __init__(
        self,
        progress: Progress,
        task: TaskID,
        minutes: float,
        store: Path,
        over: threading.Event,
    ) -> None:
        self._progress, self._task, self._over = progress, task, over
        self._seconds, self._store = 60 * minutes, store
        self._began, self._began_unix, self.stage = time.monotonic(), time.time(), "starting"

    def at(self, stage: str) -> None:
        self.stage = stage

    def run(self) -> None:
        while not self._over.wait(REFRESH_S):
            spent = time.monotonic() - self._began
            left = max(0, round(self._seconds - spent))
            note = f"{self._training()}{left // 60}:{left % 60:02d} left"
            self._progress.update(
                self._task, completed=min(spent, self._seconds), description=self.stage, note=note
            )

    def _training(self) -> str:
        """Return the rate and survival of the training that runs."""
        if self.stage != "training":
            return ""
        try:
            rows = [p for p in self._store.glob(TRAININGS) if p.stat().st_mtime > self._began_unix]
            row = json.loads(max(rows, key=lambda path: path.stat().st_mtime).read_text())
        except (OSError, ValueError):  # none yet, or it has just ended
            return ""
        rate, survived = row.get("steps_per_s") or 0.0, row.get("survived_s")
        up = "" if survived is None else f"up for {survived:.1f} s, "
        return f"{rate:,.0f} steps/s, {up}"
