"""A deploy pack of feedback without a network: the same targets, from measurements alone."""

import hashlib
import json
import shutil
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

from robojackson.api.feedback_pack import write_feedback_pack
from robojackson.errors import BadConfiguration, BadPolicy
from robojackson.formats.deploy.feedback_runner import ImuRobot, Runner
from robojackson.formats.deploy.state_estimator import matrix
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.rl.config.train_config import EvaluateConfig
from robojackson.rl.evaluation.controllers import trained_driver
from robojackson.rl.evaluation.policy_evaluation import evaluate_policy
from robojackson.rl.evaluation.rollouts import Driver
from robojackson.rl.feedback.driven_clip import driven_clip
from robojackson.rl.sim.accelerometer import Accelerometer
from robojackson.rl.sim.motors import Motors
from robojackson.rl.sim.simulation import Simulation
from robojackson.rl.trackers.regulator_tracker import RegulatorTracker
from robojackson.rl.trackers.tracker_description import TrackerDescription, TrackerFile
from robojackson.robot.model import Robot, load_robot
from tests.fixtures.deploy_policies import bare_packages, lose, run_bare, swaying
from tests.fixtures.robots import stock
from tests.rl.conftest import make_reference, sway_angles

pytestmark = pytest.mark.xdist_group("feedback_pack")
NAME, IMU = "stock_onboard", (0.1, -0.05, -0.1)


@dataclass(frozen=True)
class Made:
    """A pack and what it was made from."""

    folder: Path
    robot: Robot
    reference: ReferenceMotion
    tracker: RegulatorTracker


def tracker_of(root_state: str = "estimated") -> RegulatorTracker:
    described = TrackerDescription(
        name=NAME, robot="humanoid", network="regulator", licence="ours", trained_on="nothing",
        homepage="here", control_dt=0.015, root_state=root_state,  # type: ignore[arg-type]
    )  # fmt: skip
    tracker = RegulatorTracker(described)
    tracker.control = replace(tracker.control, feedback_path="reference")
    return tracker


@pytest.fixture(scope="module", params=["repeats", "ends"])
def made(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Made:
    """Return a pack of a robot whose accelerometer is off its root, of a motion that travels."""
    folder, cyclic = tmp_path_factory.mktemp(request.param), request.param == "repeats"
    robot = load_robot(replace(stock().description, imu=IMU))
    reference = swaying(robot, cyclic)
    offset = np.array([0.03, 0.01, 0.0]) * cyclic
    return written(folder, robot, replace(reference, cycle_offset=offset))


def written(folder: Path, robot: Robot, reference: ReferenceMotion) -> Made:
    """Write a motion and its pack."""
    reference.save(folder / "reference.parquet")
    tracker = tracker_of()
    write_feedback_pack(tracker, folder / "reference.parquet", folder / "pack", robot=robot)
    return Made(folder / "pack", robot, reference, tracker)


class Replayed:
    """A robot that measures what a simulation does, and keeps the targets it is given."""

    def __init__(self, sim: Simulation, robot: Robot) -> None:
        self.joints, self.sim, self.shown = list(robot.joint_names), sim, np.zeros(3)
        self.target: np.ndarray = np.zeros(robot.model.nu)

    def read(self) -> tuple[np.ndarray, ...]:
        """Return what a robot reads."""
        qpos, qvel = self.sim.qpos[0], self.sim.qvel[0]
        return qpos[3:7], qvel[3:6], qpos[7:], qvel[6:]

    def force(self) -> np.ndarray:
        """Return what the accelerometer showed."""
        return self.shown

    def drive(self, target: np.ndarray, stiffness: np.ndarray, damping: np.ndarray) -> None:
        """Keep the targets."""
        self.target = target


def largest_difference(made: Made, turn: float = 0.0) -> float:
    """Return the largest difference between the targets of the pack and of the tracker, of one
    robot, along a rollout that begins near the end of a cycle, rad."""
    robot, tracker, shown = made.robot, made.tracker, []

    class Heard(Accelerometer):
        def read(self) -> np.ndarray:
            shown.append(super().read())
            return shown[-1]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("robojackson.rl.evaluation.tracker_driver.Accelerometer", Heard)
        driver: Driver = trained_driver(tracker, robot, made.reference)
        clip = driven_clip(robot, made.reference, driver.control)
        sim, start, found = Simulation(robot, driver.control, 1), np.array([45]), []
        begin = clip.at(start)
        sim.place(np.array([0]), begin.qpos, begin.qvel)
        replayed = Replayed(sim, robot)
        runner = Runner(made.folder, replayed)
        runner.begin(45)
        motor = np.argsort(Motors.of(robot.model).hinge)
        for step in range(1, 31 if clip.cyclic else 14):
            command = driver.command(sim, clip.at(start + step), start, np.zeros((1, 17)))
            replayed.shown = shown[-1][0]
            reason = runner.step()
            if reason:
                break
            found.append(np.abs(command[0, motor] - replayed.target).max())
            held = np.clip(replayed.target, runner.cfg["limits"]["lower"],
                           runner.cfg["limits"]["upper"])  # fmt: skip
            np.testing.assert_array_equal(held, replayed.target)
            sim.step(command)
    assert len(found) > 10
    moved = runner.rows["targets"][(45 + len(found)) % len(made.reference)] - replayed.target
    assert np.abs(moved).max() > 1e-3, "the feedback moves something"
    return float(max(found))


def test_targets_may_press_a_joint_on_its_end_and_ranges_are_never_narrower(made: Made) -> None:
    limits, (low, high) = Runner(made.folder).cfg["limits"], made.robot.model.jnt_range[1:].T
    assert (np.array(limits["lower"]) <= low).all()
    assert (np.array(limits["upper"]) >= high).all()
    assert (np.array(limits["upper"]) > high).any()


def test_targets_are_those_of_the_tracker(made: Made) -> None:
    assert largest_difference(made) < 1e-5


def test_the_runner_is_short_and_needs_two_packages(made: Made) -> None:
    for name in ("run.py", "network_runner.py", "simulated_robot.py", "state_estimator.py"):
        text = (made.folder / name).read_text()
        assert len(text.splitlines()) <= 150
        assert "robojackson." not in text
    result = subprocess.run(
        [sys.executable, "run.py", "--help"], cwd=made.folder, capture_output=True, text=True,
        check=True,
    )  # fmt: skip
    assert "numpy and mujoco alone" in result.stdout
    assert "onnx" not in result.stdout


@pytest.mark.slow
def test_alone_it_survives_as_long_as_in_the_evaluation(
    tmp_path: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    robot = stock()
    made = written(tmp_path, robot, make_reference(robot, sway_angles))
    packages = bare_packages(tmp_path_factory.mktemp("two"), ("numpy", "mujoco"))
    code = """
import importlib.util
import numpy as np
assert importlib.util.find_spec("robojackson") is None
assert importlib.util.find_spec("onnxruntime") is None
sys.path.insert(0, sys.argv[1])
import run
runner = run.Runner()
robot, found = runner.robot, []
for row in range(0, 80, 10):
    robot.data.qpos[:], robot.data.qvel[:] = (runner.rows[key][row] for key in ("qpos", "qvel"))
    robot.before = robot.speed()
    runner.begin(row)
    steps = 0
    while steps < 200 and robot.data.qpos[2] > 0.7 and not runner.step():
        steps += 1
    found.append(steps * runner.cfg["step_dt"])
print(np.mean(found))
print(run.main(0.15, 0.3, False, run.Runner))
"""
    result = run_bare(packages, code, str(made.folder), cwd=tmp_path)
    assert result.returncode == 0, result.stderr
    survived, said = result.stdout.splitlines()
    assert said.startswith("danced 0.15 s")
    config = EvaluateConfig(phases=8, resets=1, seconds=3.0, threads=1)
    summary = evaluate_policy(made.tracker, made.reference, robot, config).summary
    assert float(survived) > 1
    assert abs(float(survived) / float(str(summary["survived_s"])) - 1) < 0.3


def test_the_accelerometer_feels_what_ours_feels(made: Made) -> None:
    sim, quiet = Simulation(made.robot, made.tracker.control, 1), np.array([0])
    sim.place(quiet, made.robot.standing[None], 0.3 * np.ones((1, made.robot.model.nv)))
    ours = Accelerometer(sim, IMU)
    theirs = ImuRobot(made.robot.model, {"limits": {}, "step_dt": sim.dt})
    theirs.imu, theirs.noise = np.array(IMU), 0.0
    theirs.data.qpos[:], theirs.data.qvel[:] = sim.qpos[0], sim.qvel[0]
    theirs.before = theirs.speed()
    sim.step(np.zeros((1, made.robot.model.nu)))
    theirs.data.qpos[:], theirs.data.qvel[:] = sim.qpos[0], sim.qvel[0]
    np.testing.assert_allclose(theirs.force(), ours.read()[0], atol=0.5)
    assert np.linalg.norm(theirs.force()) > 5


@pytest.mark.parametrize("angle", [0.8, -2.5])
def test_the_motion_is_turned_to_where_the_robot_faces(made: Made, angle: float) -> None:
    found = []
    for facing in (0.0, angle):
        runner = Runner(made.folder)
        qpos, turned = made.reference.qpos[0].copy(), np.zeros(4)
        mujoco.mju_mulQuat(turned, np.array([np.cos(facing / 2), 0, 0, np.sin(facing / 2)]),
                           qpos[3:7])  # fmt: skip
        qpos[3:7] = turned
        runner.robot.data.qpos[:] = qpos
        runner.begin(0)
        assert runner.step() == ""
        found.append(runner.robot.data.ctrl.copy())
    np.testing.assert_allclose(found[0], found[1], atol=1e-6)


@pytest.mark.parametrize("harm", ["tilt", "speed", "nan"])
def test_it_stops_before_it_drives_a_robot_that_is_lost(made: Made, harm: str) -> None:
    runner = Runner(made.folder)
    data = runner.robot.data
    data.qpos[:] = made.reference.qpos[0]
    runner.begin(0)
    assert runner.step() == ""
    began = data.time
    lose(runner, harm)
    assert runner.step() != ""
    assert data.time == began


def copied(made: Made, folder: Path) -> Path:
    return Path(shutil.copytree(made.folder, folder / "pack"))


def test_feedback_of_another_pack_is_refused(made: Made, tmp_path: Path) -> None:
    other = copied(made, tmp_path)
    with (other / "feedback.npz").open("ab") as file:
        file.write(b"\0")
    with pytest.raises(SystemExit, match=r"refused: feedback\.npz is not the one of deploy\.yaml"):
        Runner(other)


def test_joints_in_another_order_are_refused(made: Made, tmp_path: Path) -> None:
    other = copied(made, tmp_path)
    file = other / "deploy.yaml"
    first, second = made.robot.joint_names[:2]
    text = file.read_text()
    file.write_text(text.replace(f'"{first}", "{second}"', f'"{second}", "{first}"'))
    assert file.read_text() != text
    with pytest.raises(SystemExit, match="refused: the robot's joints are"):
        Runner(other)


def test_its_files_name_what_a_real_robot_needs(made: Made) -> None:
    lines = (made.folder / "deploy.yaml").read_text().splitlines()
    pairs = (line.partition(": ") for line in lines if line[0] != "#")
    found: dict[str, Any] = {key: json.loads(value) for key, _, value in pairs}
    assert next(iter(found)) == "joint_ids_map"
    assert found["imu"] == list(IMU)
    content = (made.folder / "feedback.npz").read_bytes()
    assert found["feedback"] == hashlib.sha256(content).hexdigest()
    assert len(found["soles"]) == len(made.robot.contact_names)
    text = (made.folder / "README.md").read_text()
    assert all(word in text for word in ("`force()`", "feedback.npz", "numpy mujoco", "gantry"))
    assert "onnx" not in text
    licences = json.loads((made.folder / "licences.json").read_text())["inputs"]
    assert ["tracker", "own"] in [[one["kind"], one["licence"]] for one in licences]
    assert not any(one["kind"] == "weights" for one in licences)


def test_what_needs_more_than_a_robot_measures_is_refused(made: Made, tmp_path: Path) -> None:
    path = made.folder.parent / "reference.parquet"
    with pytest.raises(BadPolicy, match=r"'stock_onboard' cannot go .*root_state: estimated"):
        write_feedback_pack(tracker_of("exact"), path, tmp_path / "pack", robot=made.robot)
    assert not (tmp_path / "pack").exists()


def test_a_licence_of_no_kind_is_refused_before_the_feedback_is_computed(
    made: Made, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("robojackson.api.feedback_pack.deployed_feedback", pytest.fail)
    path = made.folder.parent / "reference.parquet"
    with pytest.raises(BadConfiguration, match="film=MIT: kinds are"):
        write_feedback_pack(
            made.tracker, path, tmp_path, robot=made.robot, licences={"film": "MIT"}
        )


def test_an_evaluation_of_another_tracker_is_refused_and_one_beside_it_is_left_out(
    made: Made, tmp_path: Path, write_evaluation: Callable[[Path, str], Path]
) -> None:
    shutil.copy(made.folder.parent / "reference.parquet", tmp_path)
    given = write_evaluation(tmp_path, "twist2")
    words = (made.tracker, tmp_path / "reference.parquet", tmp_path / "pack")
    with pytest.raises(BadConfiguration, match=r"not an evaluation of 'stock_onboard': make one"):
        write_feedback_pack(*words, robot=made.robot, evaluation=given)
    assert write_feedback_pack(*words, robot=made.robot)["passport_cases"] == 0
    write_evaluation(tmp_path, NAME)
    written = write_feedback_pack(*words, robot=made.robot)
    assert (written["passport_cases"], written["weakest_case"]) == (2, "noise")
    assert "| noise | 40 |" in (tmp_path / "pack" / "README.md").read_text()


@pytest.fixture
def write_evaluation() -> Callable[[Path, str], Path]:
    """Return a writer of an evaluation.json of a tracker."""

    def write(folder: Path, tracker: str) -> Path:
        rows = [
            {"case": "nominal", "strict_success": 1.0},
            {"case": "noise", "strict_success": 0.4},
        ]
        text = json.dumps({"tracker": tracker, "success": 1.0, "passport": rows})
        path = folder / "evaluation.json"
        path.write_text(text)
        return path

    return write


def test_a_rotation_matrix_is_mujocos() -> None:
    half = 0.3
    found = matrix(np.array([np.cos(half), 0, 0, np.sin(half)]))
    np.testing.assert_allclose(found[:2, 0], [np.cos(2 * half), np.sin(2 * half)])


def test_a_tracker_with_a_network_is_not_written_without_it(made: Made, tmp_path: Path) -> None:
    tracker = tracker_of()
    file = TrackerFile(name="dancer.safetensors", size=1, sha256="0" * 64)
    tracker.description = replace(tracker.description, file=file)
    with pytest.raises(BadPolicy, match="cannot go into a deploy pack"):
        write_feedback_pack(tracker, made.folder.parent / "reference.parquet", tmp_path / "pack")
    assert not (tmp_path / "pack").exists()
