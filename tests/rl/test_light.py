"""Judging a policy is light: the whole command loads no library that trains or orchestrates."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from robojackson.files import tables
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.rl.config.train_config import ControlConfig
from robojackson.rl.modes.observation import Observer
from robojackson.rl.policy import Policy
from robojackson.robot.model import Robot
from tests.fixtures.commands import robojackson


@pytest.mark.medium
def test_the_command_evaluate_loads_nothing_that_trains(
    robot: Robot, sway: ReferenceMotion, tmp_path: Path
) -> None:
    model, size = robot.model, Observer(robot, "full").size
    nothing = (np.zeros((size, model.nu)), np.zeros(model.nu))
    facts = {"robot": "humanoid", "control": dataclasses.asdict(ControlConfig())}
    (tmp_path / "policy.safetensors").write_bytes(Policy((nothing,), facts).to_bytes())
    (tmp_path / "reference.parquet").write_bytes(tables.encode(sway))
    words = ["evaluate", tmp_path / "policy.safetensors", tmp_path / "reference.parquet"]
    brief = ["-o", tmp_path / "out", "--seconds=0.3", "--set=evaluate.phases=2"]
    done = robojackson(*words, *brief)
    assert done.code == 0, done.err
    assert (tmp_path / "out" / "evaluations.parquet").is_file()
    assert done.loaded == []
