"""`deploy.yaml` and `robot.xml`: what Unitree's and the pack's own runner read."""

import hashlib
import json

import mujoco
import numpy as np
import onnxruntime
import pytest
import yaml

from robojackson.formats.deploy.deployed_machine import places_in_mjcf
from robojackson.formats.deploy.settings_yaml import UNITREE_TERMS
from robojackson.pipeline.robot_descriptions import describe_robot
from robojackson.rl.feedback.driven_clip import driven_clip
from robojackson.rl.policy_facts import policy_control
from robojackson.rl.sim.simulation import Simulation
from robojackson.robot.model import load_robot
from tests.fixtures.robots import G1
from tests.formats.deploy.conftest import Pack


def settings(pack: Pack) -> dict:
    return yaml.safe_load((pack.folder / "deploy.yaml").read_text())


def test_a_reader_of_yaml_finds_what_the_runner_reads_line_by_line(pack: Pack) -> None:
    lines = (pack.folder / "deploy.yaml").read_text().splitlines()
    pairs = (line.partition(": ") for line in lines if line[0] != "#")
    assert {key: json.loads(value) for key, _, value in pairs} == settings(pack)


def test_it_has_the_keys_of_unitrees_runner(pack: Pack) -> None:
    found, count = settings(pack), len(pack.robot.joint_names)
    assert found["joint_ids_map"] == list(range(count))
    action = found["actions"]["JointPositionAction"]
    assert action["offset"] == found["default_joint_pos"]
    assert {len(action["scale"]), len(found["stiffness"]), len(found["damping"])} == {count}
    assert tuple(found["observations"]) == UNITREE_TERMS
    sizes = [len(term["scale"]) for term in found["observations"].values()]
    assert sizes == [2 * count, 6, 3, count, count, count]


@G1
@pytest.mark.parametrize(("name", "gaps"), [("g1", []), ("g1_23", [13, 14, 20, 21, 27, 28])])
def test_the_motors_keep_their_numbers_where_joints_are_welded(name: str, gaps: list[int]) -> None:
    """The numbers of Unitree's motors: that of 23 lacks two at the waist, four at the wrists."""
    found = places_in_mjcf(load_robot(describe_robot(name)))
    assert list(found) == [place for place in range(29) if place not in gaps]


def test_offsets_follow_from_sizes_and_the_hash_from_all(pack: Pack) -> None:
    found, at = settings(pack), 0
    for term in found["observation_terms"]:
        assert term["offset"] == at
        at += term["size"]
    terms = [[term["name"], term["size"]] for term in found["observation_terms"]]
    text = json.dumps([terms, list(pack.robot.joint_names), found["anchor_body_name"]])
    assert found["layout"] == [hashlib.sha256(text.encode()).hexdigest(), at]
    graph = onnxruntime.InferenceSession(str(pack.folder / "policy_obs.onnx"))
    about = graph.get_modelmeta().custom_metadata_map
    assert [about["observation_layout_sha256"], graph.get_inputs()[0].shape[1]] == found["layout"]


def test_gains_limits_and_scale_are_the_robots_hinge_by_hinge(pack: Pack) -> None:
    found, robot, own = settings(pack), pack.robot, pack.robot.actuation
    np.testing.assert_allclose(found["stiffness"], own.stiffness)
    np.testing.assert_allclose(found["damping"], own.damping)
    np.testing.assert_allclose(found["limits"]["torque"], own.torque_limit)
    np.testing.assert_allclose(found["limits"]["speed"], own.speed_limit)
    np.testing.assert_allclose(found["action_scale"], own.action_scale)
    np.testing.assert_allclose(found["default_joint_pos"], robot.standing[7:])
    assert found["step_dt"] == pack.reference.dt


def aimed(pack: Pack) -> np.ndarray:
    """Return the targets of a pack's motion as its training has them, hinge by hinge."""
    control = policy_control(pack.policy, pack.robot)
    sim = Simulation(pack.robot, control, len(pack.reference))
    clip = driven_clip(pack.robot, pack.reference, control)
    angles = sim.reference_angles(clip.at(np.arange(len(pack.reference))))
    return angles[:, np.argsort(sim.motors.hinge)]


@pytest.mark.parametrize("which", ["pack", "hipped"])
def test_no_target_of_motion_and_network_lies_outside_the_limits(
    which: str, request: pytest.FixtureRequest
) -> None:
    """The targets of a motion lead it by its torques, beyond the ends of joints (`hipped`)."""
    pack: Pack = request.getfixturevalue(which)
    robot, found, targets = pack.robot, settings(pack)["limits"], aimed(pack)
    lower, upper = np.array(found["lower"]), np.array(found["upper"])
    beyond = (targets < robot.lower) | (targets > robot.upper)
    assert beyond.any() == (which == "hipped")
    full = robot.actuation.action_scale
    reached = (targets - full).min(0), (targets + full).max(0)
    np.testing.assert_allclose(lower, np.minimum(robot.lower, reached[0]), atol=1e-6)
    np.testing.assert_allclose(upper, np.maximum(robot.upper, reached[1]), atol=1e-6)


def test_the_written_robot_falls_as_the_robot_does(pack: Pack) -> None:
    written = mujoco.MjModel.from_xml_path(str(pack.folder / "robot.xml"))
    assert not written.nmesh
    ends = []
    for model in (pack.robot.model, written):
        data = mujoco.MjData(model)
        data.qpos[:] = pack.reference.qpos[0]
        data.ctrl[:] = 0.1
        for _ in range(100):
            mujoco.mj_step(model, data)
        ends.append(data.qpos.copy())
    np.testing.assert_allclose(*ends, atol=1e-3)
    assert np.abs(ends[0] - pack.reference.qpos[0]).max() > 0.05
