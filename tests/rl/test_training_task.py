"""Which checkpoints a training may continue."""

from collections.abc import Mapping
from dataclasses import asdict, replace
from pathlib import Path

import pytest

from robojackson.errors import BadConfiguration
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.rl.config.tqc_config import ActorStart
from robojackson.rl.config.train_config import TqcConfig, TrainConfig
from robojackson.rl.training_task import NOT_GIVEN, Task
from robojackson.robot.model import Robot

CONFIG = TrainConfig(steps=1)
SET = replace(CONFIG, tqc=TqcConfig(burn_in=0))


@pytest.fixture
def task(robot: Robot, sway: ReferenceMotion) -> Task:
    """Return the task of a motion."""
    return Task.of(sway, robot)


def of_before(kept: Mapping[str, object]) -> dict[str, object]:
    """Return a configuration as checkpoints held it before zeros could be given."""
    tqc = kept["tqc"]
    assert isinstance(tqc, dict)
    filled = {n: asdict(ActorStart()).get(n) if x is None else x for n, x in tqc.items()}
    return {name: value for name, value in kept.items() if name != NOT_GIVEN} | {"tqc": filled}


def test_a_zero_that_is_given_is_another_training_than_none(task: Task) -> None:
    now = task.identity(CONFIG)
    task.require_same(task.identity(CONFIG), now, Path())
    with pytest.raises(BadConfiguration, match=r"tqc\.burn_in: 0 there, null here"):
        task.require_same(task.identity(SET), now, Path())
    with pytest.raises(BadConfiguration, match=r"tqc\.burn_in: null there, 0 here"):
        task.require_same(now, task.identity(SET), Path())


@pytest.mark.parametrize("preset", ["dance", "paper", "released", "polish"])
def test_a_checkpoint_from_before_zeros_could_be_given_had_none(task: Task, preset: str) -> None:
    config = replace(CONFIG, tqc=TqcConfig(preset=preset))  # type: ignore[arg-type]
    now = task.identity(config)
    task.require_same(of_before(now), now, Path())


def test_such_a_checkpoint_does_not_go_on_with_a_zero(task: Task) -> None:
    with pytest.raises(BadConfiguration, match=r"tqc\.burn_in: null there, 0 here"):
        task.require_same(of_before(task.identity(CONFIG)), task.identity(SET), Path())
