"""What a training announces to whoever may stop it."""

import dataclasses
import signal
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from robojackson.api import policy_training
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.rl.config.train_config import TqcConfig, TrainConfig
from robojackson.rl.training import Hooks, train_policy
from robojackson.rl.training_hooks import stopped_by_interrupt
from robojackson.rl.training_run import Run
from robojackson.robot.model import Robot

SMALL = TqcConfig(
    n_envs=4, warmup=128, batch=32, updates_per_round=2, steps_per_round=8, actor=(8,), critic=(8,)
)
CONFIG = TrainConfig(trainer="sb3", steps=320, tqc=SMALL)


@pytest.fixture
def updates(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Return the gradient updates of the trainer at every round."""
    seen: list[int] = []
    tick = Run.tick

    def spy(run: Run) -> None:
        seen.append(run.trainer.updates())
        tick(run)

    monkeypatch.setattr(Run, "tick", spy)
    return seen


@pytest.mark.medium
def test_learning_is_announced_once_after_the_first_updates(
    robot: Robot, sway: ReferenceMotion, tmp_path: Path, updates: list[int]
) -> None:
    """Before, there is nothing to save: whoever stops the training need not wait for it."""
    announced: list[int] = []
    hooks = Hooks(on_learning=lambda: announced.append(len(updates)))
    train_policy(sway, robot, CONFIG, tmp_path, hooks)
    first = next(i for i, count in enumerate(updates, 1) if count > 0)
    assert 1 < first < len(updates)
    assert announced == [first]


@pytest.mark.medium
def test_a_resumed_training_announces_only_what_its_checkpoint_lacks(
    robot: Robot, sway: ReferenceMotion, tmp_path: Path, updates: list[int]
) -> None:
    train_policy(sway, robot, CONFIG, tmp_path)
    updates.clear()
    announced: list[int] = []
    longer = dataclasses.replace(CONFIG, steps=480)
    train_policy(
        sway, robot, longer, tmp_path, Hooks(on_learning=lambda: announced.append(len(updates)))
    )
    assert updates[0] > 0
    assert announced == [next(i for i, n in enumerate(updates, 1) if n > updates[0])]


@pytest.fixture
def handler() -> Iterator[None]:
    """Give SIGINT Python's own handler, which a worker of xdist may not have."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.medium
def test_an_interrupt_of_the_function_saves_what_was_learnt(
    robot: Robot, sway: ReferenceMotion, tmp_path: Path, updates: list[int], handler: None
) -> None:
    """Only the command did: the exception landed anywhere in a round."""
    hooks = Hooks(on_learning=lambda: signal.raise_signal(signal.SIGINT))
    with pytest.raises(KeyboardInterrupt):
        policy_training.train_policy(
            sway, robot, config=CONFIG, out=tmp_path, force=True, hooks=hooks
        )
    assert (tmp_path / "checkpoint" / "run.json").is_file()
    assert updates[-1] > 0
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def interrupt(times: int, learnt: bool, stops: list[bool]) -> None:
    """Press Ctrl-C in a training, and add after each what `stop` returns."""
    with stopped_by_interrupt(Hooks()) as hooks:
        if learnt:
            hooks.on_learning()
        for _ in range(times):
            signal.raise_signal(signal.SIGINT)
            stops.append(hooks.stop())


@pytest.mark.parametrize(
    ("times", "learnt", "expected"), [(1, True, [True]), (2, True, [True]), (1, False, [])]
)
def test_an_interrupt_requests_a_stop_where_there_is_learning_and_a_second_one_ends_at_once(
    times: int, learnt: bool, expected: list[bool], handler: None
) -> None:
    """The exception comes too where the training ends by itself before it can stop."""
    stops: list[bool] = []
    with pytest.raises(KeyboardInterrupt):
        interrupt(times, learnt, stops)
    assert stops == expected


def test_another_handler_and_another_thread_are_left_alone(handler: None) -> None:
    given, found = Hooks(), []

    def enter() -> None:
        with stopped_by_interrupt(given) as hooks:
            found.append(hooks)

    thread = threading.Thread(target=enter)
    thread.start()
    thread.join()
    signal.signal(signal.SIGINT, lambda *signalled: None)
    enter()
    assert all(hooks is given for hooks in found)
    assert len(found) == 2
