"""A first description of a model that no one has described comes near to what a person wrote."""

import json
import re
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest
import yaml

from robojackson.cli.pictures.robot_sheets import new_robot
from robojackson.errors import BadConfiguration
from robojackson.pipeline.robot_descriptions import read_description
from robojackson.retarget.retarget_config import RetargetConfig
from robojackson.retarget.retargeting import retarget_motion
from robojackson.retarget.targets.tails import TailConfig
from robojackson.rl.config.train_config import ControlConfig, EvaluateConfig
from robojackson.rl.evaluation.strict_success import StrictEvaluator
from robojackson.rl.sim.simulation import resolved
from robojackson.robot.description import RobotDescription
from robojackson.robot.description_check import problems
from robojackson.robot.first_description import Draft, first_description, name_of_model
from robojackson.robot.keypoint_guess import guess_keypoints
from robojackson.robot.limbs import skeleton_of
from robojackson.robot.model import load_robot
from tests.fixtures import machine
from tests.fixtures.own_robot import gymnasium_model
from tests.fixtures.robots import description, human, robot_motion

NEAR_MM = 1.0
"""Between the same motion on the guessed robot and on the shipped one, mean over keypoints."""


def drafted(model: Path, folder: Path) -> tuple[Draft, RobotDescription]:
    draft = first_description(model, folder, "drafted")
    path = folder / "drafted.yaml"
    path.write_text(draft.text)
    return draft, read_description(path)


def model_file(folder: Path, text: str) -> Path:
    path = folder / "model.xml"
    path.write_text(text)
    return path


def test_humanoid_v5_is_described_as_the_shipped_file_does(tmp_path: Path) -> None:
    draft, found = drafted(gymnasium_model(), tmp_path)
    shipped = description()
    assert (draft.left, draft.guessed, problems(found)) == ((), (), [])
    for part in ("root_body", "sites", "weights", "contacts", "rest_pose", "control_dt"):
        assert getattr(found, part) == getattr(shipped, part), part


def test_a_drafted_robot_is_evaluated_as_the_g1_is(tmp_path: Path) -> None:
    _, found = drafted(gymnasium_model(), tmp_path)
    g1 = description("g1")
    assert (found.fall, found.strict) == (g1.fall, g1.strict)
    robot = load_robot(found)
    assert TailConfig().applies_to(robot)
    assert StrictEvaluator(robot, robot_motion("hip_shake"), EvaluateConfig())


@pytest.mark.medium
def test_a_motion_for_the_drafted_humanoid_is_that_for_the_shipped_one(tmp_path: Path) -> None:
    _, found = drafted(gymnasium_model(), tmp_path)
    motion = retarget_motion(human("hip_shake"), load_robot(found), RetargetConfig())
    shipped = robot_motion("hip_shake")
    apart = np.linalg.norm(motion.keypoints_w - shipped.keypoints_w, axis=-1).mean()
    assert 1e3 * apart < NEAR_MM


def test_a_machine_with_ankles_and_soles_is_described_with_its_corners(tmp_path: Path) -> None:
    draft, found = drafted(model_file(tmp_path, machine.mjcf()), tmp_path)
    written = machine.description(tmp_path)
    assert (draft.left, draft.guessed) == (("torque_limits",), ("sites.head",))
    (line,) = problems(found)
    assert "unstable" in line, "its hinges have no armature"
    assert problems(replace(found, armature={"*": 0.05})) == []
    assert found.sites.keys() == written.sites.keys()
    assert {k: body for k, (body, _) in found.sites.items()} == {
        k: body for k, (body, _) in written.sites.items()
    }
    apart = [np.subtract(found.sites[k][1], written.sites[k][1]) for k in found.sites]
    assert np.abs(apart).max() < 0.025
    assert found.contacts.keys() == written.contacts.keys()
    assert found.rest_pose["left_knee"] == 0.3


@pytest.mark.parametrize("half", [0.004, 0.01, 0.02])
def test_the_soles_of_a_box_are_its_lower_side_however_thin_it_is(
    half: float, tmp_path: Path
) -> None:
    """Balls that were thicker than the box hung below it."""
    text = machine.mjcf().replace('size=".07 .03 .01"', f'size=".07 .03 {half}"')
    _, found = drafted(model_file(tmp_path, text), tmp_path)
    soles = {ball.offset[2] - ball.radius for ball in found.contacts.values()}
    assert found.sites["left_foot"][1][2] + max(soles) == pytest.approx(-0.02 - half, abs=2e-4)
    assert np.ptp(list(soles)) < 2e-4


def test_toes_are_not_the_foot(tmp_path: Path) -> None:
    plain = guess_keypoints(skeleton_of(mujoco.MjModel.from_xml_string(machine.mjcf())))
    toe = (
        '<body name="{0}_toe" pos=".1 0 -.02"><geom size=".01" fromto="0 0 0 .03 0 0" mass=".05"/>'
        '<joint name="{0}_toe_pitch" axis="0 1 0" range="-.5 .5"/></body>'
    )
    text = machine.mjcf()
    for side in ("left", "right"):
        site = f'<site name="{side}_foot"'
        text = text.replace(site, toe.format(side) + site)
    toed = guess_keypoints(skeleton_of(mujoco.MjModel.from_xml_string(text)))
    assert toed["left_foot"] == plain["left_foot"]


def test_a_model_below_the_file_is_named_from_there(tmp_path: Path) -> None:
    (tmp_path / "parts").mkdir()
    draft = first_description(model_file(tmp_path / "parts", machine.mjcf()), tmp_path, "it")
    assert yaml.safe_load(draft.text)["mjcf"] == "parts/model.xml"


def test_meaningless_names_leave_the_joints_to_the_tree(tmp_path: Path) -> None:
    names = sorted(set(re.findall(r'<(?:body|joint) name="(\w+)"', machine.mjcf())))
    text = machine.mjcf()
    for number, name in enumerate(names):
        text = re.sub(rf'"{name}"', f'"p{number}"', text)
    draft, found = drafted(model_file(tmp_path, text), tmp_path)
    written = machine.description(tmp_path)
    known = {f"p{number}": name for number, name in enumerate(names)}
    assert {key: known[body] for key, (body, _) in found.sites.items()} == {
        key: body for key, (body, _) in written.sites.items()
    }
    assert len(draft.guessed) > len(draft.left)
    assert draft.text.count("# GUESS: ") == len(draft.guessed)


def test_what_is_not_there_is_left_as_a_comment(tmp_path: Path) -> None:
    armless = re.sub(r"(?s)<body name=\"left_upper\".*?</body></body>", "", machine.mjcf())
    draft = first_description(model_file(tmp_path, armless), tmp_path, "it")
    assert {f"sites.left_{part}" for part in ("shoulder", "elbow", "hand")} <= set(draft.left)
    assert "  # left_hand: [BODY, [0.0, 0.0, 0.0]]" in draft.text
    assert "left_hand" not in yaml.safe_load(draft.text)["sites"]


def test_the_limits_that_hinges_have_themselves_are_taken(tmp_path: Path) -> None:
    text = machine.mjcf().replace('range="0 2.4"', 'range="0 2.4" actuatorfrcrange="-33 33"')
    text = re.sub(r"<position.*?/>", "", text)
    draft, found = drafted(model_file(tmp_path, text), tmp_path)
    assert found.torque_limits == {"left_knee": 33.0, "right_knee": 33.0}
    assert '  # "*_hip_pitch": 50.0' in draft.text


@pytest.mark.parametrize(("timestep", "steps"), [(0.001, 15), (0.002, 5), (0.01, 2)])
def test_a_draft_names_no_setting_of_the_training(
    timestep: float, steps: int, tmp_path: Path
) -> None:
    """The substeps are the robot's own."""
    text = machine.mjcf().replace("<compiler", f'<option timestep="{timestep}"/><compiler')
    draft, found = drafted(model_file(tmp_path, text), tmp_path)
    assert [line for line in draft.text.splitlines() if "substeps=" in line] == []
    assert f"{steps} steps of {1e3 * timestep:g} ms" in draft.text
    robot = load_robot(found)
    assert (resolved(ControlConfig(), robot).substeps, robot.substeps) == (steps, steps)


@pytest.mark.parametrize("timestep", ["0.004166666666666667", "0.00416667", "0.003333333"])
def test_a_control_step_is_that_of_the_model_to_the_last_digit(
    timestep: str, tmp_path: Path
) -> None:
    """Six digits made a step that `robots check` refuses."""
    text = machine.mjcf().replace("<worldbody>", f'<option timestep="{timestep}"/><worldbody>')
    _, found = drafted(model_file(tmp_path, text), tmp_path)
    assert load_robot(found).substeps == 5
    assert found.control_dt == pytest.approx(5 * float(timestep), abs=1e-10)


@pytest.mark.parametrize("reach", ["-2.4 -.034907", "-2.4 -.034851", "-.034958 -.034957"])
def test_a_hinge_that_cannot_be_straight_rests_within_its_range(reach: str, tmp_path: Path) -> None:
    text = machine.mjcf().replace('range="-2.4 0"', f'range="{reach}"')
    _, found = drafted(model_file(tmp_path, text), tmp_path)
    low, high = map(float, reach.split())
    for side in ("left", "right"):
        assert low <= found.rest_pose[f"{side}_elbow"] <= high
        assert abs(found.rest_pose[f"{side}_elbow"] - high) <= 1e-4


def test_odd_names_stay_text(tmp_path: Path) -> None:
    text = machine.mjcf().replace('"base"', '"no: 1"')
    _, found = drafted(model_file(tmp_path, text), tmp_path)
    assert found.root_body == "no: 1"


@pytest.mark.parametrize("content", ["<mujoco", "<mujoco/>", "text"])
def test_what_is_no_robot_is_one_line(tmp_path: Path, content: str) -> None:
    with pytest.raises(BadConfiguration, match=r"^\S*model\.xml: .+$"):
        first_description(model_file(tmp_path, content), tmp_path, "it")


def test_a_model_is_called_as_it_calls_itself(tmp_path: Path) -> None:
    named = model_file(tmp_path, machine.mjcf().replace('"machine"', json.dumps("My Robot-2")))
    assert name_of_model(named) == "my_robot_2"


def test_a_name_of_a_file_is_one_that_a_description_may_have(tmp_path: Path) -> None:
    model = model_file(tmp_path, machine.mjcf())
    out = tmp_path / f"my robot ({'x' * 80}).yaml"
    new_robot(model, out, force=False)
    assert read_description(out).name == f"my_robot_{'x' * 55}"


@pytest.mark.parametrize("beside", ["<worldbody>{}", "{}</worldbody>"])
def test_a_free_object_is_not_the_robot(beside: str, tmp_path: Path) -> None:
    ball = (
        '<body name="ball" pos="2 0 9"><freejoint/><geom name="puck" size=".1" mass=".4"/></body>'
    )
    text = gymnasium_model().read_text()
    alone, _ = drafted(model_file(tmp_path, text), tmp_path)
    crowded = text.replace(beside.format(""), beside.format(ball))
    found, described = drafted(model_file(tmp_path, crowded), tmp_path)
    assert found.text == alone.text
    (problem,) = problems(described)
    assert "'ball' has the free joint: only 'torso' may move freely" in problem
