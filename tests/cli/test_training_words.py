"""The command that goes on with a training."""

import json
import shlex
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest

from robojackson.cli.cards import command_line
from robojackson.cli.training_words import train_after, train_longer, train_this
from robojackson.motion.reference_motion import poses_sha256
from robojackson.pipeline.yaml_loader import load
from robojackson.rl.config.train_config import TrainConfig
from robojackson.rl.policy import Policy
from robojackson.rl.training_task import NOT_GIVEN, Task
from tests.fixtures.robots import robot_motion

USUAL = TrainConfig()


def folder_of(config: TrainConfig, tmp_path: Path) -> Path:
    (tmp_path / "checkpoint").mkdir()
    settings = {**asdict(config), NOT_GIVEN: None, "task": {"robot": "humanoid"}}
    facts = {"configuration": settings}
    (tmp_path / "checkpoint" / "run.json").write_text(json.dumps(facts))
    return tmp_path


@pytest.mark.parametrize(
    ("config", "words"),
    [
        (USUAL, ""),
        (replace(USUAL, seed=3), " --set=seed=3"),
        (replace(USUAL, tqc=replace(USUAL.tqc, warmup=200)), " --set=tqc.warmup=200"),
        (replace(USUAL, tqc=replace(USUAL.tqc, burn_in=0)), " --set=tqc.burn_in=0"),
        (replace(USUAL, trainer="sb3"), " --set=trainer=sb3"),
    ],
)
def test_it_names_every_setting_that_the_checkpoint_insists_on(
    config: TrainConfig, words: str, tmp_path: Path
) -> None:
    folder = folder_of(config, tmp_path)
    result = train_longer(Path("r.parquet"), folder, 20)
    assert result == f"robojackson train r.parquet -o {folder} --minutes 20{words}"


@pytest.mark.parametrize(
    ("setup", "given"),
    [
        (None, {"mode": "paper"}),
        (None, {"mode": "paper", "tqc.n_steps": "3"}),
        (None, {"mode": "paper", "tqc.preset": "dance"}),
        (None, {"mode": "paper", "tqc.preset": "released", "tqc.batch": "256", "trainer": "sb3"}),
        (None, {"mode": "paper", "paper.preset": "released", "paper.lambda_max": "1.0"}),
        (None, {"mode": "paper", "paper.weights": "{pelvis: 1.0}"}),
        (None, {"tqc.preset": "polish", "tqc.zero_init": "false"}),
        (None, {"track.observation": "onboard", "track.random.integrators": "[RK4, Euler]"}),
        (None, {"start": "'runs #2/[v2] é.safetensors'"}),
        (None, {"start": "'3'"}),
        ("setups/walker-paper", {}),
        ("setups/pretrained-dancer", {}),
    ],
)
def test_its_settings_are_those_of_the_checkpoint(
    setup: str | None, given: dict[str, str], tmp_path: Path
) -> None:
    """What equals a default of another mode or preset was left out, and then refused."""
    task, config = Task("humanoid", "a", "b", "c"), load(TrainConfig, setup, given)
    folder = folder_of(config, tmp_path)
    state = {"configuration": task.identity(config)}
    (folder / "checkpoint" / "run.json").write_text(json.dumps(state))
    words = shlex.split(train_longer(Path("r"), folder, 20))
    pairs = [word.removeprefix("--set=") for word in words if word.startswith("--set=")]
    typed = dict(pair.split("=", 1) for pair in pairs)
    assert task.identity(load(TrainConfig, None, typed)) == task.identity(config)


@pytest.mark.parametrize(("used", "minutes"), [(0.0, 20), (5.0, 20), (20.0, 40), (30.01, 61)])
def test_the_budget_is_above_what_is_used(used: float, minutes: int, tmp_path: Path) -> None:
    """A budget counts every sitting: the same 20 minutes trained nothing."""
    folder = folder_of(USUAL, tmp_path)
    file = folder / "checkpoint" / "run.json"
    file.write_text(json.dumps({**json.loads(file.read_text()), "seconds": 60 * used}))
    assert train_longer(Path("r"), folder, 20).endswith(f" --minutes {minutes}")


def test_a_checkpoint_from_before_a_setting_insists_on_that_of_then(tmp_path: Path) -> None:
    folder = folder_of(USUAL, tmp_path)
    file = folder / "checkpoint" / "run.json"
    kept = json.loads(file.read_text())
    del kept["configuration"]["tqc"]["n_steps"], kept["configuration"][NOT_GIVEN]
    kept["configuration"]["tqc"]["burn_in"] = 0
    file.write_text(json.dumps(kept))
    assert train_longer(Path("r"), folder, 20).endswith("--minutes 20 --set=tqc.n_steps=1")


def test_a_folder_without_a_checkpoint_is_trained_from_the_start(tmp_path: Path) -> None:
    assert train_longer(Path("r"), tmp_path, 20).endswith("--minutes 20")


@pytest.mark.medium
@pytest.mark.parametrize("robot", [None, "own.yaml"])
def test_a_motion_that_the_gate_refuses_is_trained_on_by_force(
    robot: str | None, tmp_path: Path
) -> None:
    motion = robot_motion("hip_shake")
    words = () if robot is None else ("--robot", robot)
    for share, force in ((0.0, ()), (0.5, ("--force",))):
        card = {**motion.scorecard, "infeasible_share": share}
        reference = replace(motion, scorecard=card).save(tmp_path / "reference.parquet")
        expected = ("train", reference, "-o", tmp_path / "training", *words, *force)
        assert train_this(reference, robot) == command_line(*expected)
        longer = ("train", reference, "-o", tmp_path, "--minutes", 20, *words, *force)
        assert train_longer(reference, tmp_path, 20, robot) == command_line(*longer)


@pytest.mark.parametrize("same", [True, False])
def test_a_policy_of_another_motion_is_not_trained_on(same: bool, tmp_path: Path) -> None:
    """Its folder refuses another motion, so the command that was shown failed."""
    motion = robot_motion("hip_shake")
    reference = motion.save(tmp_path / "clip" / "reference.parquet")
    learnt = poses_sha256(motion) if same else "another"
    layers = ((np.zeros((2, 1)), np.zeros(1)),)
    policy = Policy(layers, {"reference_sha256": learnt}).save(tmp_path / "run" / "p.safetensors")
    folder = tmp_path / "run" if same else tmp_path / "clip" / "training"
    words = f"train {reference} -o {folder}" + (" --minutes 20" if same else "")
    assert train_after(policy, reference, 20) == f"robojackson {words}"
