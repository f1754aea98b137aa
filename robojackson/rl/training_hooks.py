"""Callbacks of a training: reports to the caller, and a way to stop."""

import signal
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace

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


@contextmanager
def stopped_by_interrupt(hooks: Hooks) -> Iterator[Hooks]:
    """Yield hooks with which Ctrl-C ends a training after a round, with a checkpoint.

    A second Ctrl-C ends it at once, and so does one before there is learning to save. Nothing
    changes outside the main thread, or where another handler than Python's own receives SIGINT.

    Raises:
        KeyboardInterrupt: Ctrl-C, also where the training was over before it could stop.
    """
    default = signal.default_int_handler
    in_main = threading.current_thread() is threading.main_thread()
    if not in_main or signal.getsignal(signal.SIGINT) is not default:
        yield hooks
        return
    interrupt = _Interrupt(hooks)
    signal.signal(signal.SIGINT, interrupt.receive)
    try:
        yield replace(hooks, stop=interrupt.stop, on_learning=interrupt.mark_learning)
    finally:
        signal.signal(signal.SIGINT, default)
    if interrupt.received:
        raise KeyboardInterrupt


class _Interrupt:
    """Whether Ctrl-C was pressed while there was learning to save."""

    def __init__(self, hooks: Hooks) -> None:
        self._hooks, self._has_learnt, self.received = hooks, False, False

    def stop(self) -> bool:
        return self._hooks.stop() or self.received

    def mark_learning(self) -> None:
        self._has_learnt = True
        self._hooks.on_learning()

    def receive(self, number: int, frame: object) -> None:
        if self.received or not self._has_learnt:
            raise KeyboardInterrupt
        self.received = True
