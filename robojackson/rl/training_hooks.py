"""What a caller of a training is told while it runs, and how it stops one."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from robojackson.rl.modes.rewards import RewardFunction

Row = dict[str, float]


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
        audited: Called once before it begins, with what the reward pays to bodies that do not dance
            (`evaluation.reward_audit.audit_record`).
        rewards: Reward terms of the caller, by name, beside those of the configuration.
    """

    progress: Callable[[Row], None] = lambda row: None
    sink: Callable[[list[Row]], None] = lambda rows: None
    on_learning: Callable[[], None] = lambda: None
    saving: Callable[[], None] = lambda: None
    stop: Callable[[], bool] = lambda: False
    setup: str = ""
    audited: Callable[[Mapping[str, Mapping[str, float]]], None] = lambda audit: None
    rewards: Mapping[str, RewardFunction] = field(default_factory=dict)
