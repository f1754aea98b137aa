"""Callbacks of a training: reports to the caller, and a way to stop."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from robojackson.rl.config.train_config import PaperConfig, TrackConfig
from robojackson.rl.modes.rewards import RewardFunction
from robojackson.rl.policy import Policy

Row = dict[str, float]
Choice = Callable[[Policy], Policy]
"""Makes the policy that is written from the one that was trained."""


def as_trained(policy: Policy) -> Policy:
    """Return a policy as it is."""
    return policy


class BudgetSpent(Exception):
    """The budget of a training is used up."""


@dataclass(frozen=True)
class Hooks:
    """Callbacks of a training.

    Attributes:
        progress: Called every few seconds with steps, rate, survival and the time left.
        sink: Called with one row for each finished episode.
        on_learning: Called once, when the networks first hold learning that no checkpoint holds.
        saving: Called before a checkpoint is written: the caller should save its rows.
        stop: Called between two rounds; True ends the run with a checkpoint.
        setup: Name of the configuration, written into the policy's file.
        audited: Called once at the beginning with the rewards of bodies that do not dance
            (`evaluation.reward_audit.audit_record`).
        paying: Called once at the beginning with the environment that pays the training; that of
            a polish is not the configuration's (`polish.paid_environment`).
        rewards: Further reward terms by name.
    """

    progress: Callable[[Row], None] = lambda row: None
    sink: Callable[[list[Row]], None] = lambda rows: None
    on_learning: Callable[[], None] = lambda: None
    saving: Callable[[], None] = lambda: None
    stop: Callable[[], bool] = lambda: False
    setup: str = ""
    audited: Callable[[Mapping[str, Mapping[str, float]]], None] = lambda audit: None
    paying: Callable[[TrackConfig | PaperConfig], None] = lambda environment: None
    rewards: Mapping[str, RewardFunction] = field(default_factory=dict)
