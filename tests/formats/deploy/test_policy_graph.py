"""The ONNX files of a deploy pack compute the policy's own targets."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import onnxruntime
import pytest

from robojackson.formats.deploy.policy_graph import MOTION, targets_before
from robojackson.geometry.rotations import quat_to_matrix
from robojackson.pipeline.robot_descriptions import describe_robot
from robojackson.rl.evaluation.controllers import trained_driver
from robojackson.rl.sim.feedforward import lead_of
from robojackson.rl.sim.motors import Motors
from robojackson.rl.sim.reference_clip import Clip
from robojackson.rl.sim.simulation import Simulation
from robojackson.robot.model import load_robot
from tests.fixtures.robots import G1
from tests.formats.deploy.conftest import Pack, made

NAMES = ("policy.onnx", "policy_obs.onnx")


def session(pack: Pack, name: str = NAMES[0]) -> onnxruntime.InferenceSession:
    return onnxruntime.InferenceSession(str(pack.folder / name))


def column(session: onnxruntime.InferenceSession, key: str) -> np.ndarray:
    about = session.get_modelmeta().custom_metadata_map
    return np.array([float(word) for word in about[key].split(",")])


def run(session: onnxruntime.InferenceSession, seen: np.ndarray, step: int) -> np.ndarray:
    feed = {"obs": seen.astype(np.float32)[None], "time_step": np.array([[step]], np.float32)}
    known = {one.name for one in session.get_inputs()}
    return session.run(["actions"], {k: v for k, v in feed.items() if k in known})[0][0]


def observation(pack: Pack, sim: Simulation, row: int, last: np.ndarray) -> np.ndarray:
    """Return mjlab's terms, from MuJoCo's own body poses."""
    data, expected = sim.datas[0], np.asarray(pack.reference.qpos, float)[row]
    robot, root = pack.robot, pack.robot.model.body(pack.robot.description.root_body).id
    head = robot.model.site_bodyid[robot.keypoint_sites[robot.keypoint_names.index("head")]]
    here = data.xmat[head].reshape(3, 3)
    other = Simulation(robot, sim.control, 1)
    other.place(np.array([0]), expected[None], np.zeros((1, robot.model.nv)))
    there = other.datas[0].xmat[head].reshape(3, 3)
    assert not np.allclose(quat_to_matrix(expected[3:7]), here) or head == root
    default, qpos, qvel = robot.standing[7:], sim.qpos[0], sim.qvel[0]
    speeds, apart = np.asarray(pack.reference.qvel, float)[row, 6:], (here.T @ there)[:, :2]
    terms = [expected[7:], speeds, apart.ravel(), qvel[3:6], qpos[7:] - default, qvel[6:], last]
    return np.concatenate(terms)


def largest_difference(pack: Pack, name: str, steps: int = 25, start: int = 50) -> float:
    """Return the largest difference between the targets of graph and policy along a rollout of the
    policy, rad."""
    robot, graph = pack.robot, session(pack, name)
    driver = trained_driver(pack.policy, robot, pack.reference)
    clip = Clip(pack.reference, lead_of(robot, pack.reference, driver.control))
    sim, found = Simulation(robot, driver.control, 1), []
    at = clip.at(np.array([start]))
    sim.place(np.array([0]), at.qpos, at.qvel)
    residual, last = np.zeros((1, robot.model.nu)), np.zeros(robot.model.nu)
    default, scale = column(graph, "default_joint_pos"), column(graph, "action_scale")
    motor = np.argsort(Motors.of(robot.model).hinge)
    for t in range(steps):
        following = clip.at(np.array([start + t + 1]))
        command = driver.command(sim, following, np.array([start]), residual)
        residual = (command - sim.reference_angles(following)) / sim.residual
        row = (start + t + 1) % len(pack.reference) if clip.cyclic else start + t + 1
        last = run(graph, observation(pack, sim, row, last), row)
        found.append(np.abs(default + scale * last - command[0][motor]).max())
        sim.step(command)
    assert np.abs(residual).max() > 0.05, "the policy adds something"
    return float(max(found))


@pytest.mark.parametrize("name", NAMES)
def test_targets_are_those_of_the_policy(pack: Pack, name: str) -> None:
    assert largest_difference(pack, name) < 1e-5


@pytest.mark.parametrize("name", NAMES)
def test_hinges_between_root_and_anchor_and_a_lead_change_nothing(hipped: Pack, name: str) -> None:
    assert largest_difference(hipped, name, start=10) < 1e-5


def test_the_file_has_the_inputs_and_outputs_of_mjlab(pack: Pack) -> None:
    found, size = session(pack), 9 + 5 * len(pack.robot.joint_names)
    assert [(i.name, i.shape) for i in found.get_inputs()] == [
        ("obs", [1, size]),
        ("time_step", [1, 1]),
    ]
    assert [o.name for o in found.get_outputs()] == ["actions", *MOTION]
    plain = session(pack, NAMES[1])
    assert [i.name for i in plain.get_inputs()] == ["obs"]
    assert [o.name for o in plain.get_outputs()] == ["actions"]


def test_actions_do_not_depend_on_how_a_runner_counts_its_steps(pack: Pack) -> None:
    graph, rng = session(pack), np.random.default_rng(1)
    seen = rng.normal(0, 0.3, 9 + 5 * len(pack.robot.joint_names))
    np.testing.assert_array_equal(run(graph, seen, 3), run(graph, seen, 4))


def test_the_motion_comes_out_at_the_step_and_its_end_is_held(pack: Pack) -> None:
    graph, seen = session(pack), np.zeros((1, 9 + 5 * len(pack.robot.joint_names)), np.float32)
    motion = np.load(pack.folder / "motion.npz")
    names = graph.get_modelmeta().custom_metadata_map["body_names"].split(",")
    columns = [motion["body_names"].tolist().index(name) for name in names]
    for step, row in ((7, 7), (1000, len(pack.reference) - 1)):
        given = {"obs": seen, "time_step": np.array([[step]], np.float32)}
        out = dict(zip(MOTION, graph.run(list(MOTION), given), strict=True))
        np.testing.assert_array_equal(out["joint_pos"][0], motion["joint_pos"][row])
        np.testing.assert_array_equal(out["body_quat_w"][0], motion["body_quat_w"][row, columns])


def test_the_motion_is_the_reference_itself(pack: Pack) -> None:
    motion = np.load(pack.folder / "motion.npz")
    np.testing.assert_allclose(motion["joint_pos"], pack.reference.qpos[:, 7:], atol=1e-6)
    np.testing.assert_allclose(motion["joint_vel"], pack.reference.qvel[:, 6:], atol=1e-5)
    np.testing.assert_allclose(motion["fps"], [1 / pack.reference.dt])


def test_the_metadata_are_those_of_mjlabs_exporter(pack: Pack) -> None:
    about = session(pack).get_modelmeta().custom_metadata_map
    assert about["joint_names"].split(",") == list(pack.robot.joint_names)
    assert about["observation_names"] == (
        "command,motion_anchor_ori_b,base_ang_vel,joint_pos,joint_vel,actions"
    )
    assert about["anchor_body_name"] in about["body_names"].split(",")
    own = pack.robot.actuation
    np.testing.assert_allclose(column(session(pack), "joint_stiffness"), own.stiffness, rtol=1e-6)
    np.testing.assert_allclose(column(session(pack), "joint_damping"), own.damping, rtol=1e-6)


def test_a_held_pose_comes_before_itself(hipped: Pack) -> None:
    """A command that stands still in the motion's tail was the command one step ago, too."""
    from robojackson.api.deploy_pack import deployed_policy

    reference = hipped.reference
    qpos, qvel = np.array(reference.qpos), np.array(reference.qvel)
    qpos[40:], qvel[40:] = qpos[40], 0.0
    parts = deployed_policy(hipped.policy, reference, hipped.robot)
    still = replace(parts.machine, reference=replace(reference, qpos=qpos, qvel=qvel))
    parts = replace(parts, machine=still, lead=0 * parts.lead)
    before = targets_before(parts)
    np.testing.assert_array_equal(before[40:], qpos[40:, 7:])
    np.testing.assert_array_equal(before[1:40], qpos[:39, 7:])


@G1
@pytest.mark.medium
def test_the_g1_has_mjlabs_154_inputs_and_bodies(tmp_path: Path) -> None:
    pack = made(tmp_path, load_robot(describe_robot("g1")))
    about = session(pack).get_modelmeta().custom_metadata_map
    assert session(pack).get_inputs()[0].shape == [1, 154]
    assert about["anchor_body_name"] == "torso_link"
    legs = [f"{side}_{part}_link" for side in ("left", "right")
            for part in ("hip_roll", "knee", "ankle_roll")]  # fmt: skip
    arms = [f"{side}_{part}_link" for side in ("left", "right")
            for part in ("shoulder_roll", "elbow", "wrist_yaw")]  # fmt: skip
    assert about["body_names"].split(",") == ["pelvis", *legs, "torso_link", *arms]
    assert largest_difference(pack, NAMES[0]) < 1e-5
