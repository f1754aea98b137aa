"""Trainings that start from a policy: the shipped dancer's, or another file of ours."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from flows.study.study_plan import study_of
from robojackson.cli.learning.training_request import requested
from robojackson.errors import BadPolicy
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.pipeline.tracker_descriptions import describe_tracker, require_tracker
from robojackson.rl.config.train_config import TqcConfig, TrackConfig, TrainConfig
from robojackson.rl.modes.observation import Observer
from robojackson.rl.policy import load_policy
from robojackson.rl.pretrained import pretrained
from robojackson.rl.tqc.network_arrays import load_networks
from robojackson.rl.trackers.tracker_file import require_file
from robojackson.rl.training import train_policy
from robojackson.rl.walkers import ASSETS, DANCER
from robojackson.robot.model import Robot, load_robot
from tests.fixtures.deploy_policies import random_policy, swaying
from tests.fixtures.robots import G1, description

QUIET = TqcConfig(n_envs=2, warmup=1000, batch=8, buffer=1000, critic=(10,), log_std_init=-2.0)
LARGEST = 10_000_000
"""Bytes that the dancer may have."""


def test_a_training_starts_from_the_actor_of_a_policy_with_the_noise_that_is_set(
    robot: Robot, sway: ReferenceMotion, tmp_path: Path
) -> None:
    given = random_policy(robot, sway)
    start = given.save(tmp_path / "given.safetensors")
    config = TrainConfig(
        steps=16, start=str(start), tqc=QUIET,
        track=TrackConfig("onboard", control=replace(TrackConfig().control, feedback=0.0)),
    )  # fmt: skip
    train_policy(sway, robot, config, tmp_path / "run")
    trained = load_policy(tmp_path / "run" / "policy.safetensors")
    for (weight, bias), (weight_2, bias_2) in zip(trained.layers, given.layers, strict=True):
        np.testing.assert_allclose(weight, weight_2, atol=1e-6)
        np.testing.assert_allclose(bias, bias_2, atol=1e-6)
    networks = load_networks(tmp_path / "run" / "networks.safetensors")
    np.testing.assert_array_equal(networks.tensors["log_std.bias"], np.float32(-2.0))
    assert not networks.tensors["log_std.weight"].any()
    assert networks.has_critics


def test_a_training_goes_on_without_the_file_that_it_started_from(
    robot: Robot, sway: ReferenceMotion, tmp_path: Path
) -> None:
    start = random_policy(robot, sway).save(tmp_path / "given.safetensors")
    track = TrackConfig("onboard", control=replace(TrackConfig().control, feedback=0.0))
    config = TrainConfig(steps=16, start=str(start), tqc=QUIET, track=track)
    train_policy(sway, robot, config, tmp_path / "run")
    start.unlink()
    assert train_policy(sway, robot, replace(config, steps=32), tmp_path / "run").steps == 32
    with pytest.raises(BadPolicy, match="no such file"):
        train_policy(sway, robot, config, tmp_path / "another")


def test_a_policy_that_sees_something_else_is_refused(
    robot: Robot, sway: ReferenceMotion, tmp_path: Path
) -> None:
    start = random_policy(robot, sway).save(tmp_path / "given.safetensors")
    config = TrainConfig(steps=16, start=str(start), tqc=QUIET)
    with pytest.raises(BadPolicy, match=r"observes onboard .* full.*observation=onboard"):
        train_policy(sway, robot, config, tmp_path / "run")


@pytest.mark.parametrize(
    ("facts", "message"),
    [
        (
            {"control": {"action_factor": 4.0}},
            r"another .* law: --set track\.control\.action_factor=4",
        ),
        ({"robot": "g1"}, "was trained for robot 'g1', not for 'humanoid'"),
    ],
)
def test_a_policy_whose_actions_mean_something_else_is_refused(
    robot: Robot, sway: ReferenceMotion, tmp_path: Path, facts: dict[str, object], message: str
) -> None:
    given = random_policy(robot, sway)
    other = replace(given, facts={**given.facts, **facts}).save(tmp_path / "other.safetensors")
    config = TrainConfig(steps=16, start=str(other), tqc=QUIET, track=TrackConfig("onboard"))
    with pytest.raises(BadPolicy, match=message):
        train_policy(sway, robot, config, tmp_path / "run")


def test_a_policy_without_a_hidden_layer_and_a_cut_one_are_no_start(
    robot: Robot, sway: ReferenceMotion, tmp_path: Path
) -> None:
    given = random_policy(robot, sway)
    flat = replace(given, layers=given.layers[:1]).save(tmp_path / "flat.safetensors")
    with pytest.raises(BadPolicy, match="without a hidden layer"):
        pretrained(str(flat), "track")
    cut = tmp_path / "cut.safetensors"
    cut.write_bytes(given.to_bytes()[:3000])
    with pytest.raises(BadPolicy, match="no networks or policy file of ours"):
        pretrained(str(cut), "track")


def test_the_dancer_is_small_and_what_its_tracker_pins() -> None:
    assert (ASSETS / DANCER).stat().st_size < LARGEST
    assert require_file(describe_tracker("dancer")) == ASSETS / DANCER


def test_no_dance_uses_it_unless_it_is_named(store_folder: Path) -> None:
    chosen = require_tracker("g1")
    assert chosen is not None
    assert chosen.name == "regulator"


@G1
def test_the_setup_trains_the_dancer(tmp_path: Path) -> None:
    robot = load_robot(description("g1"))
    config = requested(None, "pretrained-dancer", {}).train
    config = replace(config, steps=64, tqc=replace(config.tqc, n_envs=2, warmup=1000))
    train_policy(swaying(robot), robot, config, tmp_path / "run")
    policy = load_policy(tmp_path / "run" / "policy.safetensors")
    assert policy.observation_size == Observer(robot, "preview").actor_size
    for (weight, _), (weight_2, _) in zip(
        policy.layers, load_policy(ASSETS / DANCER).layers, strict=True
    ):
        np.testing.assert_allclose(weight, weight_2, atol=1e-6)


@G1
def test_another_robot_or_mode_cannot_start_from_it() -> None:
    for name in ("humanoid", "g1_23"):
        with pytest.raises(BadPolicy, match=rf"start 'dancer' is for robot 'g1', not '{name}'"):
            pretrained("dancer", "track", description(name))
    with pytest.raises(BadPolicy, match="mode track, not paper"):
        pretrained("dancer", "paper", description("g1"))


def test_a_study_of_another_robot_is_refused_before_it_begins(store_folder: Path) -> None:
    with pytest.raises(BadPolicy, match="not 'humanoid': take --setup scratch or pretrain"):
        study_of("dancer", {"robot": "humanoid"})
