"""The certificate agrees with physics: stands, flights, leans, squats and simulated hops."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from robojackson.motion.certificate import Certificate
from robojackson.retarget.feasibility.certification import Certified, certify, fallen
from robojackson.retarget.feasibility.contact_wrench import Tolerance
from robojackson.robot.fall import Fall
from robojackson.robot.model import Robot
from tests.fixtures.robots import robot_motion

DT = 0.015
G = 9.81


def _certified(robot: Robot, qpos: np.ndarray) -> Certified:
    return certify(robot, qpos, DT, None, Tolerance())


def _resting(robot: Robot) -> np.ndarray:
    """Return a stand that MuJoCo itself can balance: arms at the sides, soles on the floor,
    level."""
    qpos = robot.standing.copy()
    _bend(robot, qpos, "left_hip_y", -0.05)
    _bend(robot, qpos, "right_hip_y", -0.05)
    _bend(robot, qpos, "left_knee", -0.1)
    _bend(robot, qpos, "right_knee", -0.1)
    return _on_the_floor(robot, _balanced(robot, qpos))


def _bend(robot: Robot, qpos: np.ndarray, joint: str, angle: float) -> None:
    qpos[7 + robot.joint_names.index(joint)] = angle


def _on_the_floor(robot: Robot, qpos: np.ndarray) -> np.ndarray:
    data = mujoco.MjData(robot.model)
    data.qpos[:] = qpos
    mujoco.mj_kinematics(robot.model, data)
    lowest = min(data.geom(f"{side}_foot").xpos[2] for side in ("left", "right")) - 0.075
    out = qpos.copy()
    out[2] -= lowest
    return out


def _balanced(robot: Robot, qpos: np.ndarray) -> np.ndarray:
    """Return a pose pitched about the feet until the centre of mass is over them."""
    data, best = mujoco.MjData(robot.model), qpos
    misses = []
    pitches = np.linspace(-0.2, 0.2, 161)
    for pitch in pitches:
        turned = qpos.copy()
        turned[3:7] = [np.cos(pitch / 2), 0.0, np.sin(pitch / 2), 0.0]
        data.qpos[:] = turned
        mujoco.mj_forward(robot.model, data)
        feet = (data.geom("left_foot").xpos + data.geom("right_foot").xpos) / 2
        misses.append(abs(data.subtree_com[0][0] - feet[0]))
    pitch = pitches[int(np.argmin(misses))]
    best = qpos.copy()
    best[3:7] = [np.cos(pitch / 2), 0.0, np.sin(pitch / 2), 0.0]
    return best


def _held(qpos: np.ndarray, steps: int = 8) -> np.ndarray:
    return np.tile(qpos, (steps, 1))


def test_a_stand_is_feasible(robot: Robot):
    found = _certified(robot, _held(_resting(robot)))
    assert found.certificate.slack.max() < 1.0
    assert found.certificate.findings == ()
    assert found.torque_ratio.max() < 1.0


def test_a_levitating_body_lacks_a_contact(robot: Robot):
    qpos = _held(_resting(robot))
    qpos[:, 2] += 0.5
    found = _certified(robot, qpos)
    np.testing.assert_allclose(found.missing_bw, 1.0, atol=0.02)
    (finding,) = found.certificate.findings
    assert finding.cause == "no contact"
    assert "foot on the floor" in finding.repair


def test_no_tempo_makes_a_levitation_feasible(robot: Robot):
    qpos = _held(_resting(robot))
    qpos[:, 2] += 0.5
    np.testing.assert_array_equal(_certified(robot, qpos).certificate.tempo, 0.0)


def test_a_body_beside_its_feet_lacks_support(robot: Robot):
    leaning = _resting(robot)
    leaning[3:7] = [np.cos(0.15), 0.0, np.sin(0.15), 0.0]
    found = _certified(robot, _held(_on_the_floor(robot, leaning)))
    assert {finding.cause for finding in found.certificate.findings} == {"support"}


def test_a_body_on_one_foot_stands_only_over_it(robot: Robot):
    """One leg lifted and the trunk leaning to its side: the weight is beside the other foot."""
    qpos = _resting(robot)
    qpos[3:7] = [np.cos(0.05), -np.sin(0.05), 0.0, 0.0]
    _bend(robot, qpos, "left_hip_y", -1.2)
    _bend(robot, qpos, "left_knee", -1.5)
    found = _certified(robot, _held(_on_the_floor(robot, qpos)))
    assert found.certificate.slack.min() > 1.0
    assert {finding.cause for finding in found.certificate.findings} == {"support"}


def test_a_falling_body_needs_nothing(robot: Robot):
    qpos, time = _held(_resting(robot), 12), np.arange(12) * DT
    qpos[:, 2] += 1.0 + 2.0 * time - G / 2 * time**2
    found = _certified(robot, qpos)
    np.testing.assert_allclose(found.missing_bw, 0.0, atol=1e-3)


def test_a_jump_that_falls_too_slowly_is_not_free(robot: Robot):
    qpos, time = _held(_resting(robot), 12), np.arange(12) * DT
    qpos[:, 2] += 1.0 + 2.0 * time - 0.5 * G / 2 * time**2
    found = _certified(robot, qpos)
    np.testing.assert_allclose(found.missing_bw, 0.5, atol=0.02)


def test_a_deep_squat_names_the_knee_that_fails(robot: Robot):
    """Thighs level: the weight hangs on a lever at the knees, and motors of a tenth give way."""
    limits = replace(robot.actuation, torque_limit=0.1 * robot.torque_limit)
    weak = replace(robot, actuation=limits)
    qpos = robot.standing.copy()
    for side in ("left", "right"):
        _bend(robot, qpos, f"{side}_hip_y", -0.9)
        _bend(robot, qpos, f"{side}_knee", -1.6)
    squat = _held(_on_the_floor(robot, _balanced(robot, qpos)))
    strong, tired = _certified(robot, squat), _certified(weak, squat)
    assert strong.certificate.slack.max() < 1.0
    (finding,) = tired.certificate.findings
    assert finding.cause == "torque"
    assert finding.what.startswith(("left_knee", "right_knee"))
    assert "motors" in finding.repair


def test_an_arm_swung_too_fast_is_repaired_by_a_slower_tempo(robot: Robot):
    qpos, time = _held(_resting(robot), 60), np.arange(60) * DT
    qpos[:, 7 + robot.joint_names.index("left_elbow")] += 0.8 * np.sin(2 * np.pi * 2.2 * time)
    found = _certified(robot, qpos)
    torques = [f for f in found.certificate.findings if f.cause == "torque"]
    assert torques
    assert all(finding.what.startswith("left_") for finding in torques)
    assert all(finding.repair.startswith("slow to") for finding in torques)


def test_an_arm_held_out_costs_what_gravity_demands(robot: Robot):
    """Shoulder torque of the forearm and upper arm about the hinge, from masses and levers."""
    qpos = _resting(robot)
    found = _certified(robot, _held(qpos))
    data = mujoco.MjData(robot.model)
    data.qpos[:] = qpos
    mujoco.mj_forward(robot.model, data)
    joint = robot.model.joint("left_shoulder1").id
    torque = np.zeros(3)
    for name in ("left_upper_arm", "left_lower_arm"):
        body = robot.model.body(name).id
        weight = np.array([0.0, 0.0, -G * robot.model.body_mass[body]])
        torque += np.cross(data.xipos[body] - data.xanchor[joint], weight)
    expected = abs(torque @ data.xaxis[joint]) / 10.0
    column = robot.joint_names.index("left_shoulder1")
    assert found.torque_ratio[2, column] == pytest.approx(expected, abs=0.03)


def test_a_hop_of_mujocos_own_physics_is_feasible(robot: Robot):
    """What a simulated robot does, flight and landing, cannot be infeasible: its torques are 0."""
    qpos = _simulated(robot)
    found = _certified(robot, qpos).certificate
    assert np.mean(found.slack[2:-2] <= 1.0) > 0.9


def _simulated(robot: Robot) -> np.ndarray:
    """Simulate a stiff robot dropped from 3 cm; return one row a control step."""
    model, data = robot.model, mujoco.MjData(robot.model)
    data.qpos[:] = _resting(robot)
    data.qpos[2] += 0.03
    held = data.qpos[7:].copy()
    rows = []
    for substep in range(5 * 24):
        if substep % 5 == 0:
            rows.append(data.qpos.copy())
        for index in range(model.nu):
            joint = model.actuator_trnid[index, 0]
            error = held[joint - 1] - data.qpos[6 + joint]
            gear = model.actuator_gear[index, 0]
            data.ctrl[index] = np.clip(6 * error - 0.3 * data.qvel[5 + joint], -0.4, 0.4)
            assert gear > 0
        mujoco.mj_step(model, data)
    return np.array(rows)


def test_the_hip_shake_that_robots_have_learnt_is_feasible():
    """Trained policies dance it on stock physics at its own tempo."""
    motion = robot_motion("hip_shake")
    assert isinstance(motion.certificate, Certificate)
    assert np.mean(motion.certificate.slack <= 1.0) >= 0.95
    assert motion.scorecard["tempo_min"] == pytest.approx(1.0)


def test_the_fall_rule_sees_tilt_and_height(robot: Robot):
    qpos = _held(_resting(robot), 3)
    qpos[1, 2] = 0.69
    qpos[2, 3:7] = [np.cos(np.pi / 5), np.sin(np.pi / 5), 0.0, 0.0]
    np.testing.assert_array_equal(fallen(robot, qpos), [False, True, True])
    causes = [f.cause for f in _certified(robot, qpos).certificate.findings]
    assert causes.count("fall rule") == 2


def test_the_fall_rule_is_the_papers_on_the_stock_robot(robot: Robot):
    assert Fall.of(robot).height == pytest.approx(0.7)
