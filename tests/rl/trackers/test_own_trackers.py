"""Our own trackers: feedback along the reference, and a policy of many motions."""

from copy import copy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pydantic import ValidationError

from robojackson.errors import BadPolicy
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.pipeline.tracker_descriptions import describe_tracker, require_tracker
from robojackson.rl.config.train_config import ControlConfig, EvaluateConfig
from robojackson.rl.evaluation.policy_evaluation import evaluate_policy
from robojackson.rl.feedback import path_search, path_trial, sampled_regulator
from robojackson.rl.modes.observation import AHEAD, Kind
from robojackson.rl.sim import accelerometer
from robojackson.rl.sim.preview import preview_of
from robojackson.rl.sim.reference_clip import Clip
from robojackson.rl.trackers.policy_tracker import PolicyTracker
from robojackson.rl.trackers.regulator_tracker import RegulatorTracker
from robojackson.rl.trackers.tracker import TrackerInput
from robojackson.rl.trackers.tracker_description import TrackerDescription
from robojackson.rl.trackers.tracker_file import is_present, open_tracker
from robojackson.robot.model import Robot
from tests.fixtures.deploy_policies import random_policy
from tests.fixtures.robots import robot_motion, stock
from tests.fixtures.stand_in_tracker import stand_in

pytestmark = pytest.mark.xdist_group("own_trackers")

SHORT = EvaluateConfig(phases=3, resets=1, seconds=1.5)
REGULATOR = TrackerDescription(
    name="regulator", robot="humanoid", network="regulator", licence="ours", trained_on="nothing",
    homepage="here", control_dt=0.015, fallback=True,
)  # fmt: skip

ONBOARD = replace(REGULATOR, name="dancer", root_state="estimated")


@pytest.fixture(autouse=True)
def _store(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROBOJACKSON_STORE", str(tmp_path / "store"))


@pytest.fixture(scope="module")
def motion() -> ReferenceMotion:
    return robot_motion("dance_b")


@pytest.mark.slow
def test_the_regulator_is_evaluated_like_a_policy(
    robot: Robot, sway: ReferenceMotion, monkeypatch: pytest.MonkeyPatch
) -> None:
    few = {"TRIES": 1, "PASSES": 4, "PASSES_A_S": 0.0, "STALLS": 0, "CYCLES_S": 0.0}
    for name, value in few.items():
        monkeypatch.setattr(sampled_regulator, name, value)
    monkeypatch.setattr(path_search, "SAMPLES", 128)
    monkeypatch.setattr(path_trial, "HELD_S", 3.0)
    long = replace(SHORT, seconds=4.0)
    found = evaluate_policy(open_tracker(REGULATOR), sway, robot, long).summary
    assert found["tracker"] == "regulator"
    baselines = found["baselines"]
    assert isinstance(baselines, dict)
    assert float(str(found["survived_s"])) > 1.4 * baselines["zero_residual"]["survived_s"]


def test_the_regulator_is_for_its_robot() -> None:
    with pytest.raises(BadPolicy, match="drives robot 'g1', not 'humanoid'"):
        RegulatorTracker(replace(REGULATOR, robot="g1")).equip(stock())


def test_a_network_goes_before_the_regulator(tmp_path: Path, monkeypatch) -> None:
    described = {"regulator": REGULATOR, "standin": stand_in(tmp_path)[1]}
    module = "robojackson.pipeline.tracker_descriptions"
    monkeypatch.setattr(f"{module}.trackers_of", lambda robot: list(described.values()))
    assert require_tracker("humanoid") == REGULATOR, "the network's file is not here yet"
    monkeypatch.setattr(f"{module}.is_present", lambda each: True)
    monkeypatch.setattr(f"{module}.require_file", lambda each: tmp_path)
    assert require_tracker("humanoid") == described["standin"]


def test_the_shipped_regulator_needs_no_file() -> None:
    shipped = describe_tracker("regulator")
    assert is_present(shipped)
    assert shipped.fallback


def test_only_the_regulator_does_without_a_file() -> None:
    for network in ("twist2", "policy"):
        with pytest.raises(ValidationError, match="needs a file"):
            replace(REGULATOR, network=network)  # type: ignore[arg-type]


@pytest.mark.parametrize("kind", AHEAD)
def test_a_policy_of_many_motions_is_a_tracker(
    motion: ReferenceMotion, kind: Kind, tmp_path: Path
) -> None:
    robot: Robot = stock()
    policy = random_policy(robot, motion, kind)
    path = policy.save(tmp_path / "dancer.safetensors")
    tracker = PolicyTracker(replace(REGULATOR, network="regulator"), path)
    as_tracker = evaluate_policy(tracker, motion, robot, SHORT)
    as_policy = evaluate_policy(policy, motion, robot, SHORT)
    np.testing.assert_allclose(as_tracker.rollout_qpos, as_policy.rollout_qpos, atol=1e-9)


def test_a_copy_of_followers_leaves_the_last_actions_of_the_original(
    robot: Robot, sway: ReferenceMotion, tmp_path: Path
) -> None:
    """A performance looks ahead with copies."""
    path = random_policy(robot, sway, "preview").save(tmp_path / "dancer.safetensors")
    window = (replace(Clip(sway).at(np.array([7])), preview=preview_of(sway, robot)[[7]]),)
    seen = TrackerInput(sway.qpos[[6]], sway.qvel[[6]], sway.keypoints_w[[6]], window)
    robots, alone = (PolicyTracker(REGULATOR, path).follow(robot, 1) for _ in range(2))
    ahead = copy(robots)
    first = [ahead.targets(seen) for _ in range(3)]
    np.testing.assert_array_equal(robots.targets(seen), first[0])
    assert np.abs(first[1] - first[0]).max() > 0
    for _ in range(2):
        np.testing.assert_array_equal(alone.targets(seen), first.pop(0))


def test_a_policy_on_top_of_feedback_is_none(motion: ReferenceMotion, tmp_path: Path) -> None:
    policy = random_policy(stock(), motion, "preview")
    fed = {**policy.facts, "control": {**policy.facts["control"], "feedback": 1.0}}  # type: ignore[dict-item]
    path = replace(policy, facts=fed).save(tmp_path / "fed.safetensors")
    with pytest.raises(BadPolicy, match=r"--set track\.control\.feedback=0"):
        PolicyTracker(REGULATOR, path)


def test_the_dancer_moves_the_targets_of_the_feedback_as_its_policy_does(
    robot: Robot, sway: ReferenceMotion, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(accelerometer, "NOISE_M_S2", 0.0)
    law = ControlConfig(feedforward=1.0, feedback=1.0, feedback_path="reference")
    policy = random_policy(robot, sway, control=replace(law, root_state="estimated"))
    path = policy.save(tmp_path / "dancer.safetensors")
    dancer = RegulatorTracker(replace(ONBOARD, control_dt=sway.dt), path)
    alone = RegulatorTracker(replace(ONBOARD, control_dt=sway.dt))
    dancer.control = alone.control = law
    as_tracker, as_policy, without = (
        evaluate_policy(each, sway, robot, SHORT).rollout_qpos for each in (dancer, policy, alone)
    )
    np.testing.assert_allclose(as_tracker, as_policy, atol=1e-9)
    steps = min(len(as_tracker), len(without))
    assert np.abs(as_tracker[:steps] - without[:steps]).max() > 1e-3


@pytest.mark.parametrize(
    ("kind", "feedback", "state"),
    [("full", 1.0, "estimated"), ("onboard", 0.0, "estimated"), ("onboard", 1.0, "exact")],
)
def test_a_policy_of_the_full_state_or_without_feedback_is_no_dancer(
    motion: ReferenceMotion, kind: Kind, feedback: float, state: str, tmp_path: Path
) -> None:
    law = ControlConfig(feedback=feedback, feedback_path="reference")
    path = random_policy(stock(), motion, kind, control=law).save(tmp_path / "one.safetensors")
    with pytest.raises(BadPolicy, match=r"--set track\.observation=onboard"):
        RegulatorTracker(replace(ONBOARD, root_state=state), path)  # type: ignore[arg-type]


def test_a_policy_of_one_motion_is_none(motion: ReferenceMotion, tmp_path: Path) -> None:
    path = random_policy(stock(), motion, "onboard").save(tmp_path / "one.safetensors")
    with pytest.raises(BadPolicy, match="does not see the reference ahead"):
        PolicyTracker(REGULATOR, path)
