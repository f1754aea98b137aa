"""What a caller of a training is told while it runs, and how it stops one."""

from collections.abc import Callable
from dataclasses import dataclass

Row = dict[str, float]
SECONDS_TO_SAVE = 30.0
"""What a training that is stopped gets to write its checkpoint before it is killed, seconds."""


class BudgetSpent(Exception):
    """The budget of a training is used up."""


@dataclass(frozen=True)
class Hooks:
    """What a caller of a training is told, and how it stops one.

    Attributes:
        progress: Called every few seconds with steps, rate, survival and the time left.
        sink: Called with one row for each episode that ended.
        on_learning: Called once, when the networks first hold learning that no checkpoint does.
        saving: Called before a checkpoint is written: the rows so far should then be safe.
        stop: Asked between two rounds; True ends the run with a checkpoint.
        setup: What the caller calls the configuration; the policy's file tells it.
    """

    progress: Callable[[Row], None] = lambda row: None
    sink: Callable[[list[Row]], None] = lambda rows: None
    on_learning: Callable[[], None] = lambda: None
    saving: Callable[[], None] = lambda: None
    stop: Callable[[], bool] = lambda: False
    setup: str = ""
