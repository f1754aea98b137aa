"""Progress on stderr: done, in all, how many a second, time left."""

import logging
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    ProgressColumn,
    Task,
    TextColumn,
    TimeRemainingColumn,
)
from rich.text import Text

STEPS_WITHOUT_TERMINAL = 4
"""Progress lines of a bar that goes to a file instead of a terminal."""

log = logging.getLogger("robojackson")


@contextmanager
def bar(label: str) -> Iterator[Callable[[int, int], None]]:
    """Yield a progress bar on stderr; a few lines where stderr is no terminal."""
    console = Console(stderr=True)
    if not console.is_terminal:
        yield _plain_bar(label)
        return
    counted = (TextColumn(label), BarColumn(), MofNCompleteColumn())
    columns = (*counted, _Rate(), TimeRemainingColumn())
    with Progress(*columns, console=console, transient=True) as progress:
        task = progress.add_task(label)
        yield lambda done, total: progress.update(task, completed=done, total=total)


class _Rate(ProgressColumn):
    """Column of the items per second."""

    def render(self, task: Task) -> Text:
        return Text(f"{task.speed:.1f}/s" if task.speed else "")


def _plain_bar(label: str) -> Callable[[int, int], None]:
    reported, began = 0, time.monotonic()

    def advance(done: int, total: int) -> None:
        nonlocal reported
        share = done * STEPS_WITHOUT_TERMINAL // max(total, 1)
        if share > reported:
            reported = share
            rate = done / max(time.monotonic() - began, 1e-9)
            left = (total - done) / rate
            log.info("%s %d/%d, %.1f/s, %.0f s left", label, done, total, rate, left)

    return advance
