"""What the actions of given networks mean, beside those of the training that starts from them."""

import json
import logging
from collections.abc import Mapping
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest

from robojackson.errors import BadPolicy
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.pipeline.robot_descriptions import describe_robot
from robojackson.rl.config.train_config import ControlConfig, TqcConfig, TrackConfig, TrainConfig
from robojackson.rl.sim.motors import actuation_facts
from robojackson.rl.sim.simulation import resolved
from robojackson.rl.start_law import require_same_law
from robojackson.rl.tqc.network_arrays import Networks, load_networks
from robojackson.rl.training import train_policy
from robojackson.rl.walkers import shipped_walker
from robojackson.robot.model import Robot, load_robot

OWN = ControlConfig()
SOFT = ControlConfig(residual=0.25)
SMALL = TqcConfig(n_envs=2, warmup=1000, batch=8, buffer=1000)


def learnt(robot: Robot, control: ControlConfig, critics: bool, **facts: object) -> Networks:
    """Return networks without weights that a training with a control law has written.

    Args:
        critics: Whether they are networks.safetensors; else a policy.
    """
    tensors = {"mean.weight": np.zeros((3, 2))}
    if critics:
        tensors |= {f"{name}.0.weight": np.zeros((5, 2)) for name in ("critic1", "critic2")}
    law = resolved(control, robot)
    known = {"control": asdict(law), "actuation": actuation_facts(robot, law)}
    return Networks(tensors, {"robot": robot.description.name, **known, **facts})


@pytest.mark.parametrize("critics", [False, True], ids=["policy", "networks"])
@pytest.mark.parametrize(
    ("then", "now", "remedy"),
    [
        (SOFT, OWN, r"residual=0\.25"),
        (OWN, SOFT, r"residual=null"),
        (ControlConfig(damping=0.05), OWN, r"damping=0\.05"),
        (OWN, ControlConfig(stiffness=2.0), r"stiffness=null"),
        (ControlConfig(action_factor=4.0), OWN, r"action_factor=4\.0"),
        (ControlConfig(feedback=1.0), OWN, r"feedback=1\.0"),
        (ControlConfig(law="hold"), OWN, r"law=hold"),
    ],
    ids=lambda law: law if isinstance(law, str) else "",
)
def test_a_file_whose_actions_mean_something_else_is_refused(
    robot: Robot, critics: bool, then: ControlConfig, now: ControlConfig, remedy: str
) -> None:
    here = resolved(now, robot)
    with pytest.raises(BadPolicy, match=rf"another control law: --set track\.control\.{remedy} \("):
        require_same_law(learnt(robot, then, critics), here, robot, "a.safetensors")
    require_same_law(learnt(robot, now, critics), here, robot, "a.safetensors")


def test_the_same_numbers_by_another_name_are_the_same_law(robot: Robot) -> None:
    """The YAML of Humanoid-v5 names these multiples of the torque limits."""
    named = ControlConfig(stiffness=4.0, damping=0.1, residual=0.5, arm_residual=0.25)
    require_same_law(learnt(robot, named, True), resolved(OWN, robot), robot, "a.safetensors")


def test_a_file_from_before_gains_were_recorded_is_compared_by_its_law(robot: Robot) -> None:
    law = {"law": "pd", "residual": 0.25, "stiffness": None}
    older = Networks(learnt(robot, OWN, True).tensors, {"robot": "humanoid", "control": law})
    require_same_law(older, resolved(SOFT, robot), robot, "a.safetensors")
    with pytest.raises(BadPolicy, match=r"action_scale 0\.25 of \w+ there, 0\.5 here"):
        require_same_law(older, resolved(OWN, robot), robot, "a.safetensors")


@pytest.mark.parametrize("facts", [{}, {"from": "theirs.zip", "steps": 3}, {"control": "text"}])
def test_a_file_without_a_law_passes(robot: Robot, facts: Mapping[str, object]) -> None:
    given = Networks(learnt(robot, OWN, True).tensors, facts)
    require_same_law(given, resolved(SOFT, robot), robot, "theirs.zip")


@pytest.mark.parametrize("values", ["text", [[1.0], "a"], {"a": 1}])
def test_gains_that_are_no_numbers_are_refused_by_their_name(robot: Robot, values: object) -> None:
    given = learnt(robot, OWN, True, actuation={"stiffness": values})
    with pytest.raises(BadPolicy, match=r"actuation\.stiffness that is no list of numbers"):
        require_same_law(given, resolved(OWN, robot), robot, "a.safetensors")


def test_a_walker_of_another_law_is_one_warning_that_names_both(
    robot: Robot, caplog: pytest.LogCaptureFixture
) -> None:
    """As on a robot that is pushed, whose actions are larger (`--robust`)."""
    pushed = resolved(ControlConfig(action_factor=2.0), robot)
    require_same_law(load_networks(shipped_walker("track")), pushed, robot, "walker")
    (line,) = [record.getMessage() for record in caplog.records]
    assert "action_scale 0.5 of" in line
    assert "there, 1 here" in line
    assert "--set track.control.action_factor=1.0" in line


def test_a_walker_of_other_gains_is_no_reason_to_take_them(
    caplog: pytest.LogCaptureFixture,
) -> None:
    """The shipped one has the humanoid's damping, which shakes humanoid_strong."""
    robot = load_robot(describe_robot("humanoid_strong"))
    walker = load_networks(shipped_walker("track"))
    require_same_law(walker, resolved(ControlConfig(), robot), robot, "walker")
    (line,) = [record.getMessage() for record in caplog.records]
    assert "--set" not in line
    assert line.endswith("pretrain --kind track --robot humanoid_strong makes one of this law")


@pytest.mark.parametrize(
    ("name", "mode", "law"),
    [
        ("humanoid", "track", "pd"),
        ("humanoid", "paper", "torque"),
        ("humanoid_strong", "paper", "torque"),
    ],
)
def test_the_shipped_walkers_have_the_law_of_their_robots(
    name: str, mode: str, law: str, caplog: pytest.LogCaptureFixture
) -> None:
    robot = load_robot(describe_robot(name))
    control = resolved(ControlConfig(law=law), robot)  # type: ignore[arg-type]
    with caplog.at_level(logging.INFO):
        require_same_law(load_networks(shipped_walker(mode)), control, robot, "walker")
    assert not caplog.records


def test_a_training_refuses_networks_of_another_law_before_it_writes_a_checkpoint(
    robot: Robot, sway: ReferenceMotion, tmp_path: Path
) -> None:
    file = shipped_walker("track")
    config = TrainConfig(steps=16, start=str(file), tqc=SMALL, track=TrackConfig(control=SOFT))
    with pytest.raises(
        BadPolicy, match=r"another control law: --set track\.control\.residual=0\.5"
    ):
        train_policy(sway, robot, config, tmp_path / "run")
    assert not list((tmp_path / "run").glob("checkpoint*"))


@pytest.mark.medium
def test_a_training_starts_from_the_walker_whatever_its_law(
    robot: Robot, sway: ReferenceMotion, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    config = TrainConfig(steps=16, start="walker", tqc=SMALL, track=TrackConfig(control=SOFT))
    result = train_policy(sway, robot, config, tmp_path / "run")
    assert sum("another control law" in one.getMessage() for one in caplog.records) == 1
    facts = json.loads(
        json.dumps(load_networks(result.policy.with_name("networks.safetensors")).facts)
    )
    assert facts["control"]["residual"] == 0.25
    caplog.clear()
    train_policy(sway, robot, replace(config, steps=32), tmp_path / "run")
    warned = [one for one in caplog.records if one.levelno >= logging.WARNING]
    assert not warned, "it goes on with networks of its own law"
