"""A deploy pack of a policy that was trained on top of the feedback from an estimated root."""

import ast
import json
import shutil
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

from robojackson.api.deploy_pack import write_deploy_pack
from robojackson.errors import BadPolicy
from robojackson.formats.deploy.polished_runner import Runner
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.rl.config.train_config import ControlConfig
from robojackson.rl.evaluation.controllers import trained_driver
from robojackson.rl.feedback.driven_clip import driven_clip
from robojackson.rl.policy import Policy
from robojackson.rl.policy_facts import outline_facts
from robojackson.rl.sim import root_estimate
from robojackson.rl.sim.accelerometer import Accelerometer
from robojackson.rl.sim.motors import Motors
from robojackson.rl.sim.simulation import Simulation
from robojackson.robot.model import Robot, load_robot
from tests.fixtures.deploy_policies import bare_packages, random_policy, run_bare, swaying
from tests.fixtures.robots import stock
from tests.formats.deploy.test_feedback_pack import IMU, Replayed

pytestmark = pytest.mark.xdist_group("feedback_pack")
LAW = ControlConfig(
    feedforward=1.0, feedback=1.0, feedback_path="reference", root_state="estimated"
)
PARTS = (
    "feedback_runner.py", "network_runner.py", "run.py", "simulated_robot.py", "state_estimator.py",
)  # fmt: skip


@dataclass(frozen=True)
class Made:
    """A pack and what it was made from."""

    folder: Path
    robot: Robot
    reference: ReferenceMotion
    policy: Policy


@pytest.fixture(scope="module", params=["repeats", "ends"])
def made(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Made:
    """Return a pack of a robot whose accelerometer is off its root, of a motion that travels."""
    folder, cyclic = tmp_path_factory.mktemp(request.param), request.param == "repeats"
    robot = load_robot(replace(stock().description, imu=IMU))
    offset = np.array([0.03, 0.01, 0.0]) * cyclic
    reference = replace(swaying(robot, cyclic), cycle_offset=offset)
    policy = random_policy(robot, reference, control=LAW)
    policy.save(folder / "policy.safetensors")
    reference.save(folder / "reference.parquet")
    write_deploy_pack(folder / "policy.safetensors", folder / "pack", robot=robot)
    return Made(folder / "pack", robot, reference, policy)


def test_its_targets_are_those_of_the_evaluation(
    made: Made, monkeypatch: pytest.MonkeyPatch
) -> None:
    robot, shown, found, moved = made.robot, [np.zeros((1, 3))], [], []

    class Heard(Accelerometer):
        def read(self, noise: np.ndarray | None = None) -> np.ndarray:
            shown.append(super().read(noise))
            return shown[-1]

    monkeypatch.setattr(root_estimate, "Accelerometer", Heard)
    driver = trained_driver(made.policy, robot, made.reference)
    clip = driven_clip(robot, made.reference, driver.control)
    sim, start = Simulation(robot, driver.control, 1), np.array([45])
    begin = clip.at(start)
    sim.place(np.array([0]), begin.qpos, begin.qvel)
    replayed = Replayed(sim, robot)
    runner = Runner(made.folder, replayed)
    runner.begin(45)
    motor, last = np.argsort(Motors.of(robot.model).hinge), np.zeros((1, robot.model.nu))
    for step in range(1, 31 if clip.cyclic else 14):
        following = clip.at(start + step)
        command = driver.command(sim, following, start, last)
        replayed.shown = shown[-1][0]
        if runner.step():
            break
        found.append(np.abs(command[0, motor] - replayed.target).max())
        last = np.clip((command - sim.reference_angles(following)) / sim.residual, -1, 1)
        moved.append(np.abs(last).max())
        held = np.clip(
            replayed.target, runner.cfg["limits"]["lower"], runner.cfg["limits"]["upper"]
        )
        np.testing.assert_array_equal(held, replayed.target)
        sim.step(command)
    assert len(found) > 10
    assert min(moved) > 0.1, "the network moves something"
    assert max(found) < 1e-4


def test_its_modules_are_short_and_need_three_packages(made: Made) -> None:
    names = set()
    for name in PARTS:
        text = (made.folder / name).read_text()
        assert len(text.splitlines()) <= 150
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, ast.ImportFrom):
                names.add(str(node.module).split(".")[0])
        assert ("__main__" in text) == (name == "run.py"), "a part alone would let the robot fall"
    assert "robojackson" not in names
    assert not (made.folder / "policy_obs.onnx").exists(), "no other runner knows the feedback"
    readme = (made.folder / "README.md").read_text()
    assert "would let the robot fall" in readme
    assert {f"`{name}`" for name in PARTS if f"`{name}`" not in readme} == set()


def test_it_dances_alone(made: Made, tmp_path_factory: pytest.TempPathFactory) -> None:
    packages = bare_packages(tmp_path_factory.mktemp("three"))
    code = """
import importlib.util
assert importlib.util.find_spec("robojackson") is None
sys.path.insert(0, sys.argv[1])
import run
print(run.main(0.15, 0.3, False, run.Runner))
"""
    result = run_bare(packages, code, str(made.folder), cwd=made.folder.parent)
    assert result.returncode == 0, result.stderr
    assert result.stdout.startswith("danced 0.15 s")


def test_a_policy_of_another_path_is_refused(made: Made, tmp_path: Path) -> None:
    """As where another machine searched it."""
    clip = driven_clip(made.robot, made.reference, LAW)
    assert clip.outline is not None
    made.reference.save(tmp_path / "reference.parquet")
    for apart, fits in ((0.001, True), (0.1, False)):
        facts = {**made.policy.facts, **outline_facts(clip.outline + apart)}
        path = replace(made.policy, facts=facts).save(tmp_path / "policy.safetensors")
        if fits:
            assert write_deploy_pack(path, tmp_path / "pack", robot=made.robot)["robot"]
        else:
            with pytest.raises(BadPolicy, match="another path"):
                write_deploy_pack(path, tmp_path / "pack", robot=made.robot)


@pytest.mark.parametrize("outline", ["abc", [["a"]], 3])
def test_an_outline_that_is_none_is_refused_by_its_name(
    made: Made, outline: object, tmp_path: Path
) -> None:
    made.reference.save(tmp_path / "reference.parquet")
    facts = {**made.policy.facts, "feedback_outline": outline}
    path = replace(made.policy, facts=facts).save(tmp_path / "policy.safetensors")
    with pytest.raises(BadPolicy, match="feedback_outline"):
        write_deploy_pack(path, tmp_path / "pack", robot=made.robot)
    assert not (tmp_path / "pack").exists()


def test_a_robot_without_an_accelerometer_is_refused_before_it_moves(made: Made) -> None:
    sim = Simulation(made.robot, LAW, 1)
    blind = Replayed(sim, made.robot)
    blind.force = None  # type: ignore[method-assign,assignment]
    with pytest.raises(SystemExit, match="accelerometer"):
        Runner(made.folder, blind)


@pytest.mark.parametrize("name", ["deploy.yaml", "robot.xml", "feedback.npz", "policy.onnx"])
def test_a_pack_without_one_of_its_files_is_refused(made: Made, name: str, tmp_path: Path) -> None:
    folder = Path(shutil.copytree(made.folder, tmp_path / "pack"))
    (folder / name).unlink()
    with pytest.raises(SystemExit, match=f"refused: {name} missing in"):
        Runner(folder)


@pytest.mark.parametrize("harm", ["feedback", "layout"])
def test_parts_of_other_packs_are_refused(made: Made, harm: str, tmp_path: Path) -> None:
    folder = Path(shutil.copytree(made.folder, tmp_path / "pack"))
    file = folder / "deploy.yaml"
    lines = file.read_text().splitlines()
    place = next(i for i, line in enumerate(lines) if line.startswith(f"{harm}: "))
    lines[place] = f"{harm}: {json.dumps('0' * 64)}"
    file.write_text("\n".join(lines))
    with pytest.raises(SystemExit, match="refused"):
        Runner(folder)
