"""The live dance's physics in node: who is pushed survives as in Python, whoever dances."""

import json
import subprocess
from collections.abc import Mapping
from dataclasses import replace
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.pipeline.tracker_descriptions import describe_tracker
from robojackson.report.web.live_data import live_data
from robojackson.report.web.live_records import RECORDS
from robojackson.report.web.shown_run import RecordedRun
from robojackson.rl.evaluation.controllers import control_of, sees_ahead, trained_driver
from robojackson.rl.evaluation.rollouts import Moment, Starts, roll_out
from robojackson.rl.feedback import sampled_regulator
from robojackson.rl.feedback.driven_clip import driven_clip
from robojackson.rl.feedback.nominal_path import Gains, Progress
from robojackson.rl.feedback.regulator import regulator
from robojackson.rl.feedback.standing_feet import Feet
from robojackson.rl.modes.observation import AHEAD, Kind, Observer
from robojackson.rl.policy import Policy
from robojackson.rl.sim import accelerometer
from robojackson.rl.sim.reference_clip import Clip
from robojackson.rl.sim.simulation import Simulation
from robojackson.rl.trackers.regulator_tracker import RegulatorTracker
from robojackson.robot.fall import Fall
from robojackson.robot.model import Robot
from tests.browser.conftest import beside_pelvis, made_policy

pytestmark = [pytest.mark.browser, pytest.mark.timeout(900)]
STEPS, PUSHED_AT, SMALL = 160, 40, np.float32(0.05)
NEAR_MM = 5.0
"""Largest distance of a body from Python's after 300 substeps."""
SIZES = np.linspace(0, 2 * np.pi, RECORDS, endpoint=False)
REFERENCES = Path(__file__).parents[2] / "benchmarks/learning/references"
SCRIPT = Path(__file__).with_name("rollouts.js")
ASSETS = resources.files("robojackson") / "assets"
DANCER = resources.files("robojackson.report.pages") / "dance.js"


@pytest.fixture(scope="module")
def shaking(run: RecordedRun) -> RecordedRun:
    """Return the hip shake, all of whose steps stand on the floor."""
    return replace(run, reference=ReferenceMotion.load(REFERENCES / "hip_shake.parquet"))


def steadied(policy: Policy) -> Policy:
    """Return the same network, its corrections small, under the linear feedback along the
    reference."""
    control = {**policy.facts["control"], "feedforward": 1.0, "feedback": 1.0}  # type: ignore[dict-item]
    (first, (weight, bias)) = policy.layers
    return Policy((first, (SMALL * weight, bias)), {**policy.facts, "control": control})


def anchored(
    robot: Robot, sim: Simulation, clip: Clip, action: np.ndarray, progress: Progress
) -> Gains:
    """Return a regulator whose nominal states stand where the robot's feet stand."""
    feet = Feet(robot)
    gains = regulator(sim, clip, action, feet.count, progress)[0]
    return replace(gains, places=feet.places(gains.qpos))


def seeing_ahead(policy: Policy, run: RecordedRun, kind: Kind) -> Policy:
    """Return an untrained network that observes the robot and the reference ahead."""
    rng, size = np.random.default_rng(2), Observer(run.robot, kind).actor_size
    first = rng.normal(0, 0.3 / np.sqrt(size), (size, 64)).astype(np.float32)
    layers = ((first, policy.layers[0][1]), policy.layers[1])
    return Policy(layers, {**policy.facts, "environment": {"observation": kind}})


def in_node(data: Mapping[str, Any], pushes: np.ndarray, folder: Path) -> dict[str, np.ndarray]:
    file = folder / "dance.json"
    file.write_text(json.dumps(data))
    words = ["node", str(SCRIPT), str(ASSETS), str(DANCER), str(file), str(STEPS), str(PUSHED_AT)]
    text = json.dumps(pushes.tolist())
    done = subprocess.run(words, input=text, capture_output=True, text=True, check=True)
    return {name: np.array(values) for name, values in json.loads(done.stdout).items()}


def in_python(run: RecordedRun, data: Mapping[str, Any], pushes: np.ndarray) -> np.ndarray:
    """Return the steps survived and the mean site error of each start, in Python's MuJoCo."""
    assert run.policy is not None
    records = data["records"]
    starts = Starts(*(np.array([one[k] for one in records]) for k in ("step", "qpos", "qvel")))
    control = control_of(run.policy, run.robot)
    clip = driven_clip(run.robot, run.reference, control, sees_ahead(run.policy))
    count = [0]

    def push(moment: Moment) -> dict[str, np.ndarray]:
        count[0] += 1
        if count[0] == PUSHED_AT:
            for data, kick in zip(moment.sim.datas, pushes, strict=True):
                data.qvel[:2] += kick
            moment.sim.qvel[:, :2] += pushes
        return {}

    driver = trained_driver(run.policy, run.robot, run.reference)
    horizon = np.full(RECORDS, STEPS)
    done = roll_out(run.robot, clip, driver, starts, horizon, 1, Fall.of(run.robot), push)
    apart = beside_pelvis(run.robot, done)
    errors = [apart[: max(1, n), i].mean() for i, n in enumerate(done.length)]
    return np.column_stack([done.length, errors])


@pytest.mark.parametrize("speed", [0.3, 1.0])
def test_pushes_are_survived_as_in_python(
    shaking: RecordedRun, speed: float, tmp_path: Path
) -> None:
    """0.3 m/s, and a speed at which some fall."""
    pushed = replace(shaking, policy=steadied(made_policy(shaking.robot)))
    assert pushed.policy is not None
    data = live_data(pushed.policy, pushed.reference, pushed.robot)
    assert data is not None
    pushes = speed * np.column_stack([np.cos(SIZES), np.sin(SIZES)])
    found = in_node(data, pushes, tmp_path)
    assert found["deviations"].max() <= NEAR_MM
    theirs = found["found"]
    ours = in_python(pushed, data, pushes)
    standing = [int((rows[:, 0] == STEPS).sum()) for rows in (theirs, ours)]
    assert np.ptp(ours[:, 0]) > 10
    assert abs(standing[0] - standing[1]) <= 1
    assert abs(theirs[:, 0].mean() - ours[:, 0].mean()) <= max(1.0, ours[:, 0].std() / 2)
    assert abs(theirs[:, 1].mean() - ours[:, 1].mean()) <= max(0.001, ours[:, 1].std() / 2)


@pytest.mark.parametrize("kind", AHEAD)
def test_a_policy_that_sees_ahead_does_the_same_as_in_python(
    run: RecordedRun, kind: Kind, tmp_path: Path
) -> None:
    policy = seeing_ahead(made_policy(run.robot), run, kind)
    data = live_data(policy, run.reference, run.robot)
    assert data is not None
    found = in_node(data, np.zeros((RECORDS, 2)), tmp_path)
    assert found["deviations"].max() <= NEAR_MM / 50
    ours = in_python(replace(run, policy=policy), data, np.zeros((RECORDS, 2)))
    assert found["found"][:, 0].mean() == pytest.approx(ours[:, 0].mean(), abs=2.0)


def test_feedback_from_an_estimated_root_is_the_same_as_in_python(
    shaking: RecordedRun, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ROBOJACKSON_STORE", str(tmp_path / "store"))
    robot = replace(
        shaking.robot, description=replace(shaking.robot.description, imu=(0.1, -0.05, -0.1))
    )
    policy = steadied(made_policy(robot))
    control = {**policy.facts["control"], "root_state": "estimated"}  # type: ignore[dict-item]
    policy = Policy(policy.layers, {**policy.facts, "control": control})
    data = live_data(policy, shaking.reference, robot)
    assert data is not None
    fed = data["feedback"]
    assert isinstance(fed, dict)
    found = in_node(data, np.zeros((RECORDS, 2)), tmp_path)
    assert found["deviations"].max() <= NEAR_MM
    ours = in_python(replace(shaking, policy=policy, robot=robot), data, np.zeros((RECORDS, 2)))
    assert found["found"][:, 0].mean() == pytest.approx(ours[:, 0].mean(), abs=2.0)
    fed["odometry"]["imu"] = [1.0, 1.0, 0.0]
    without = in_node(data, np.zeros((RECORDS, 2)), tmp_path)
    assert np.median(without["deviations"]) > np.median(found["deviations"])


def test_the_tracker_of_an_estimated_root_is_the_same_as_in_python(
    shaking: RecordedRun, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ROBOJACKSON_STORE", str(tmp_path / "store"))
    monkeypatch.setattr(accelerometer, "NOISE_M_S2", 0.0)
    described = replace(
        describe_tracker("regulator_onboard"), robot="humanoid", control_dt=shaking.reference.dt
    )
    tracker = RegulatorTracker(described)
    tracker.control = replace(tracker.control, feedback_path="reference")
    data = live_data(tracker, shaking.reference, shaking.robot)
    assert data is not None
    assert data["layers"] == []
    assert data["feedback"]["odometry"]  # type: ignore[index]
    found = in_node(data, np.zeros((RECORDS, 2)), tmp_path)
    assert found["deviations"].max() <= NEAR_MM
    ours = in_python(replace(shaking, policy=tracker), data, np.zeros((RECORDS, 2)))
    assert found["found"][:, 0].mean() == pytest.approx(ours[:, 0].mean(), abs=2.0)
    assert found["found"][:, 1].mean() == pytest.approx(ours[:, 1].mean(), abs=0.002)


def test_feedback_from_where_the_feet_stand_is_the_same_as_in_python(
    shaking: RecordedRun, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ROBOJACKSON_STORE", str(tmp_path / "store"))
    monkeypatch.setattr(sampled_regulator, "sampled_regulator", anchored)
    policy = steadied(made_policy(shaking.robot))
    control = {**policy.facts["control"], "feedback_path": "sampled"}  # type: ignore[dict-item]
    policy = Policy(policy.layers, {**policy.facts, "control": control})
    data = live_data(policy, shaking.reference, shaking.robot)
    assert data is not None
    fed = data["feedback"]
    assert isinstance(fed, dict)
    assert fed["places"]
    found = in_node(data, np.zeros((RECORDS, 2)), tmp_path)
    assert found["deviations"].max() <= NEAR_MM
    ours = in_python(replace(shaking, policy=policy), data, np.zeros((RECORDS, 2)))
    assert found["found"][:, 0].mean() == pytest.approx(ours[:, 0].mean(), abs=2.0)
    del fed["places"]
    without = in_node(data, np.zeros((RECORDS, 2)), tmp_path)
    assert np.median(without["deviations"]) > np.median(found["deviations"])
