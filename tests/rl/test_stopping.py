"""What a training announces to whoever may stop it."""

import dataclasses
from pathlib import Path

import pytest

from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.rl.config.train_config import TqcConfig, TrainConfig
from robojackson.rl.training import Hooks, train_policy
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
