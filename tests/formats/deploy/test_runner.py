"""`run.py` of a deploy pack: alone with three packages, within its limits, and with a stop."""

import ast
import json
import shutil
import sys
from pathlib import Path
from xml.etree import ElementTree

import mujoco
import numpy as np
import onnx
import pytest

from robojackson.formats.deploy.runner import Runner
from robojackson.rl.config.train_config import EvaluateConfig
from robojackson.rl.evaluation.controllers import trained_driver
from robojackson.rl.evaluation.rollout_records import RolloutScorer
from robojackson.rl.evaluation.rollouts import Rollouts, Starts, roll_out
from robojackson.rl.evaluation.starts import starts_of, summarise
from robojackson.rl.sim.feedforward import lead_of
from robojackson.rl.sim.reference_clip import Clip
from robojackson.robot.fall import Fall
from tests.fixtures.deploy_policies import NEEDED, lose, run_bare
from tests.formats.deploy.conftest import Pack

MOST_LINES = 150
BRIEF = EvaluateConfig(phases=5, resets=1, seconds=0.45, threads=1)
ROLL_OUT = """
import importlib.util
import sys
from pathlib import Path
import mujoco, numpy as np

pack, starts, out = map(Path, sys.argv[1:])
assert importlib.util.find_spec("robojackson") is None
sys.path.insert(0, str(pack))
spec = importlib.util.spec_from_file_location("run", pack / "run.py")
run = importlib.util.module_from_spec(spec)
spec.loader.exec_module(run)
runner, given, tracks = run.Runner(pack), np.load(starts), []
robot = runner.robot
for qpos, qvel, step in zip(given["qpos"], given["qvel"], given["step"]):
    mujoco.mj_resetData(robot.model, robot.data)
    robot.data.qpos[:], robot.data.qvel[:] = qpos, qvel
    runner.begin(int(step))
    for _ in range(given["steps"]):
        runner.step()
        tracks.append(robot.data.qpos.copy())
np.save(out, np.reshape(tracks, (len(given["step"]), -1, len(qpos))))
"""


def copied(pack: Pack, folder: Path) -> Path:
    return Path(shutil.copytree(pack.folder, folder / "pack"))


def with_setting(folder: Path, key: str, value: object) -> Path:
    """Replace a line of deploy.yaml."""
    file = folder / "deploy.yaml"
    lines = file.read_text().splitlines()
    place = next(i for i, line in enumerate(lines) if line.startswith(f"{key}: "))
    lines[place] = f"{key}: {json.dumps(value)}"
    file.write_text("\n".join(lines))
    return folder


def figures_of(
    pack: Pack, folder: Path, packages: Path, work: Path
) -> tuple[dict[str, float], dict[str, float]]:
    """Return the evaluation's figures of the policy in our simulation, and of the runner alone."""
    robot, reference = pack.robot, pack.reference
    driver, fall = trained_driver(pack.policy, robot, reference), Fall.of(robot)
    clip = Clip(reference, lead_of(robot, reference, driver.control))
    starts, labels = starts_of(robot, clip, BRIEF)
    horizon = clip.horizon(starts.step, BRIEF.seconds)
    done = roll_out(robot, clip, driver, starts, horizon, 1, fall, whole=True)
    np.savez(work / "starts.npz", qpos=starts.qpos, qvel=starts.qvel, step=starts.step,
             steps=horizon[0])  # fmt: skip
    words = (str(folder), str(work / "starts.npz"), str(work / "tracks.npy"))
    result = run_bare(packages, ROLL_OUT, *words, cwd=work)
    assert result.returncode == 0, result.stderr
    theirs = recorded(pack, clip, starts, np.load(work / "tracks.npy").transpose(1, 0, 2))
    scorer = RolloutScorer(robot, reference, BRIEF)
    both = [summarise([scorer.row("x", label, rollouts, i) for i, label in enumerate(labels)])
            for rollouts in (done, theirs)]  # fmt: skip
    return both[0], both[1]


def recorded(pack: Pack, clip: Clip, starts: Starts, qpos: np.ndarray) -> Rollouts:
    """Return states that were recorded elsewhere as a rollout that the scorer can read."""
    robot, (steps, count) = pack.robot, qpos.shape[:2]
    data, fall = mujoco.MjData(robot.model), Fall.of(robot)
    points = np.zeros((steps, count, len(robot.keypoint_names), 3))
    for t in range(steps):
        for i in range(count):
            data.qpos[:] = qpos[t, i]
            mujoco.mj_kinematics(robot.model, data)
            points[t, i] = data.site_xpos[robot.keypoint_sites]
    targets = [clip.at(starts.step + t + 1) for t in range(steps)]
    alive, length = np.ones(count, bool), np.zeros(count, int)
    for now, target in zip(qpos, targets, strict=True):
        alive &= ~fall.has_fallen(now, target.qpos)
        length += alive
    expected, there = (np.stack([getattr(t, name) for t in targets]) for name in ("points", "qpos"))
    horizon = np.full(count, steps)
    return Rollouts(length, length < horizon, horizon, qpos, points, expected, there, {}, True)


def test_the_runner_is_short_and_imports_three_packages(pack: Pack) -> None:
    text = (pack.folder / "run.py").read_text()
    assert len(text.splitlines()) <= MOST_LINES
    names = set()
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            names |= {alias.name.split(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            names.add(str(node.module).split(".")[0])
    assert names - sys.stdlib_module_names == {*NEEDED, "simulated_robot"}
    other = (pack.folder / "simulated_robot.py").read_text()
    assert len(other.splitlines()) <= MOST_LINES
    assert "robojackson" not in text + other.replace("robojackson export", "")


@pytest.mark.slow
def test_alone_it_reaches_the_figures_of_the_evaluation(
    pack: Pack, packages: Path, tmp_path: Path
) -> None:
    ours, theirs = figures_of(pack, pack.folder, packages, tmp_path)
    assert abs(ours["success"] - theirs["success"]) <= 0.02
    assert abs(ours["survived_s"] - theirs["survived_s"]) <= 0.02
    for name in ("site_error_m", "mpjpe_l_m", "mpjpe_g_m"):
        assert abs(ours[name] - theirs[name]) < 2e-3, name


@pytest.mark.slow
def test_the_figures_see_a_wrong_scale(pack: Pack, packages: Path, tmp_path: Path) -> None:
    scale = list(2 * pack.robot.actuation.action_scale)
    other = with_setting(copied(pack, tmp_path), "action_scale", scale)
    ours, theirs = figures_of(pack, other, packages, tmp_path)
    assert abs(ours["mpjpe_l_m"] - theirs["mpjpe_l_m"]) > 2e-3


@pytest.mark.slow
def test_the_command_soft_starts_dances_and_damps(
    pack: Pack, packages: Path, tmp_path: Path
) -> None:
    code = (
        f"import runpy\nsys.path.insert(0, {str(pack.folder)!r})\nsys.argv = sys.argv[1:]\n"
        "runpy.run_path(sys.argv[0], run_name='__main__')"
    )
    words = (str(pack.folder / "run.py"), "--seconds", "0.15", "--soft-start", "0.3")
    result = run_bare(packages, code, *words, cwd=tmp_path)
    assert result.returncode == 0, result.stderr
    assert result.stdout == "danced 0.15 s, then damped: the end\n"


@pytest.mark.slow
@pytest.mark.parametrize(("rows", "least_s"), [(20, 10.0), (1000, 15.0)])
def test_without_seconds_the_whole_dance_is_run_and_at_least_ten_seconds(
    pack: Pack, packages: Path, tmp_path: Path, rows: int, least_s: float
) -> None:
    code = f"""
import numpy as np
sys.path.insert(0, sys.argv[1])
import run

class Still(run.Runner):
    def load(self, folder):
        super().load(folder)
        self.roots = np.resize(self.roots, ({rows}, 7))

    def step(self):
        return ""

seconds = run.PARSER.parse_args(["--view"]).seconds
print(run.main(seconds, 0.0, False, Still))
"""
    result = run_bare(packages, code, str(pack.folder), cwd=tmp_path)
    assert result.returncode == 0, result.stderr
    assert float(result.stdout.split()[1]) == pytest.approx(least_s, abs=pack.reference.dt)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM"])
def test_a_signal_stops_it_by_damping(
    pack: Pack, packages: Path, tmp_path: Path, name: str
) -> None:
    code = f"""
import os, signal, threading
sys.path.insert(0, sys.argv[1])
import run
driven, drive = [], run.SimulatedRobot.drive
run.SimulatedRobot.drive = lambda *w: (driven.append(abs(w[2]).max()), drive(*w))
threading.Timer(1.0, lambda: os.kill(os.getpid(), signal.{name})).start()
print(run.main(5.0, 2000.0, False), driven[0], max(driven[-100:]), len(driven))
"""
    message_text = run_bare(packages, code, str(pack.folder), cwd=tmp_path)
    assert message_text.returncode == 0, message_text.stderr
    words = message_text.stdout.split()
    assert message_text.stdout.startswith("danced 0.00 s, then damped: stopped by hand")
    assert float(words[-2]) == 0.0, "no stiffness at the end"
    assert int(words[-1]) < 100_000, "of 133,333: it did not wait for the end"


def test_a_pack_that_was_copied_in_part_is_refused(pack: Pack, tmp_path: Path) -> None:
    other = copied(pack, tmp_path)
    for name in ("motion.npz", "policy.onnx"):
        (other / name).unlink()
    with pytest.raises(SystemExit, match=r"refused: policy\.onnx, motion\.npz missing in"):
        Runner(other)


def test_a_layout_with_another_hash_is_refused(pack: Pack, tmp_path: Path) -> None:
    size = 9 + 5 * len(pack.robot.joint_names)
    other = with_setting(copied(pack, tmp_path), "layout", ["0" * 64, size])
    with pytest.raises(SystemExit, match=r"refused: deploy\.yaml is for .*'000000"):
        Runner(other)


def test_a_policy_of_another_anchor_is_refused_though_its_size_fits(
    pack: Pack, hipped: Pack, tmp_path: Path
) -> None:
    other = copied(pack, tmp_path)
    shutil.copy(hipped.folder / "policy.onnx", other)
    with pytest.raises(SystemExit, match=r"refused: policy\.onnx"):
        Runner(other)


def test_a_policy_that_takes_six_inputs_more_is_refused(pack: Pack, tmp_path: Path) -> None:
    """160 instead of 154: what broke a robot, where inputs were filled up without a word."""
    other, size = copied(pack, tmp_path), 9 + 5 * len(pack.robot.joint_names)
    graph = onnx.load(other / "policy.onnx")
    graph.graph.input[0].type.tensor_type.shape.dim[1].dim_value = size + 6
    onnx.save(graph, other / "policy.onnx")
    with pytest.raises(SystemExit, match=rf"refused: policy\.onnx is for .*{size + 6}\], not for"):
        Runner(other)


def test_a_robot_with_a_joint_less_is_refused(pack: Pack, tmp_path: Path) -> None:
    other = copied(pack, tmp_path)
    tree = ElementTree.parse(other / "robot.xml")
    lost = pack.robot.joint_names[-1]
    for parent in list(tree.iter()):
        for child in list(parent):
            named = child.get("name") == lost and child.tag == "joint"
            if named or child.get("joint") == lost:
                parent.remove(child)
    tree.write(other / "robot.xml")
    with pytest.raises(SystemExit, match="refused: the robot's joints are"):
        Runner(other)


def test_a_robot_with_its_joints_in_another_order_is_refused(pack: Pack, tmp_path: Path) -> None:
    other, (first, second) = copied(pack, tmp_path), pack.robot.joint_names[:2]
    text = (other / "robot.xml").read_text()
    for old, new in ((first, "swapped"), (second, first), ("swapped", second)):
        text = text.replace(f'"{old}"', f'"{new}"')
    (other / "robot.xml").write_text(text)
    with pytest.raises(SystemExit, match="refused: the robot's joints are"):
        Runner(other)


def standing(pack: Pack) -> Runner:
    """Return a runner whose robot stands at the motion's first row."""
    runner = Runner(pack.folder)
    runner.robot.data.qpos[:] = pack.reference.qpos[0]
    runner.begin(0)
    return runner


@pytest.mark.parametrize("angle", [0.7, 2.5, -3.0])
def test_the_motion_is_turned_to_where_the_robot_faces(pack: Pack, angle: float) -> None:
    runner = standing(pack)
    straight = runner.observe(*runner.robot.read())
    turn = np.array([np.cos(angle / 2), 0, 0, np.sin(angle / 2)])
    turned = np.zeros(4)
    mujoco.mju_mulQuat(turned, turn, runner.robot.data.qpos[3:7].copy())
    runner.robot.data.qpos[3:7] = turned
    runner.begin(0)
    for name, value in runner.observe(*runner.robot.read()).items():
        np.testing.assert_allclose(value, straight[name], atol=1e-9, err_msg=name)


def test_torques_and_targets_stay_inside_the_limits(pack: Pack) -> None:
    runner = standing(pack)
    robot, limit = runner.robot, np.array(runner.cfg["limits"]["torque"])
    high = np.array(runner.cfg["limits"]["upper"])
    robot.drive(np.full(len(limit), 1e3), 1e3 * runner.kp, 0 * runner.kd)
    given = robot.data.ctrl[robot.motors] * robot.model.actuator_gear[robot.motors, 0]
    assert np.abs(given).max() > 1
    assert (np.abs(given) <= limit + 1e-9).all()
    robot.data.qpos[7:], robot.data.qvel[:] = high, 0.0
    robot.substeps = 1
    robot.drive(np.full(len(limit), 1e3), runner.kp, 0 * runner.kd)
    np.testing.assert_allclose(robot.data.ctrl, 0.0, atol=1e-9)


def test_a_joint_at_its_speed_limit_is_not_driven_faster(pack: Pack) -> None:
    runner = standing(pack)
    robot, speed = runner.robot, np.array(runner.cfg["limits"]["speed"])
    robot.substeps = 1
    for sign, driven in ((1.0, False), (-1.0, True)):
        robot.data.qpos[:], robot.data.qvel[:] = pack.reference.qpos[0], 0.0
        robot.data.qvel[6:] = sign * 1.01 * speed
        robot.drive(robot.data.qpos[7:] + 0.05, runner.kp, 0 * runner.kd)
        assert (robot.data.ctrl > 0).all() == driven


@pytest.mark.parametrize("harm", ["tilt", "speed", "nan"])
def test_it_stops_before_it_drives_a_robot_that_is_lost(pack: Pack, harm: str) -> None:
    runner = standing(pack)
    data = runner.robot.data
    assert runner.step() == ""
    began = data.time
    lose(runner, harm)
    assert runner.step() != ""
    assert data.time == began


def test_a_motion_that_ends_is_held_and_one_that_repeats_begins_again(
    pack: Pack, hipped: Pack
) -> None:
    for given, row in ((pack, 0), (hipped, len(hipped.reference) - 1)):
        runner = standing(given)
        runner.row = len(given.reference) - 1
        runner.step()
        assert runner.row == row
