"""Feed-forward: the PD law gives the torque that the reference requires."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.retarget.feasibility.certification import certify, motor_torques
from robojackson.retarget.feasibility.contact_wrench import Tolerance
from robojackson.rl.config.train_config import ControlConfig
from robojackson.rl.evaluation.rollouts import Driver, Starts, roll_out
from robojackson.rl.sim.feedforward import lead_of
from robojackson.rl.sim.motors import Motors, gains
from robojackson.rl.sim.reference_clip import Clip
from robojackson.rl.sim.simulation import resolved
from robojackson.robot.fall import Fall
from robojackson.robot.mjcf import mjcf_path
from robojackson.robot.model import Robot, load_robot

AHEAD = ControlConfig(feedforward=1.0)


def torques(robot: Robot, sway: ReferenceMotion) -> np.ndarray:
    offset = np.asarray(sway.cycle_offset, float)
    return motor_torques(robot, np.asarray(sway.qpos, float), sway.dt, offset, Tolerance())


def test_the_torques_are_those_of_the_certificate(robot: Robot, sway: ReferenceMotion) -> None:
    qpos, offset = np.asarray(sway.qpos, float), np.asarray(sway.cycle_offset, float)
    ratio = certify(robot, qpos, sway.dt, offset, Tolerance()).torque_ratio
    own = np.abs(torques(robot, sway)) / robot.torque_limit
    np.testing.assert_allclose(own[:, robot.actuated], ratio)


def test_on_the_reference_the_pd_law_gives_its_torque(robot: Robot, sway: ReferenceMotion) -> None:
    lead, hinge = lead_of(robot, sway, AHEAD), Motors.of(robot.model).hinge
    assert lead is not None
    kp, kd = gains(robot, AHEAD)
    speed = np.asarray(sway.qvel)[:, 6:][:, hinge]
    np.testing.assert_allclose(kp * lead - kd * speed, torques(robot, sway)[:, hinge], atol=1e-9)


def test_two_motors_of_a_hinge_give_its_torque_together(
    robot: Robot, sway: ReferenceMotion, tmp_path: Path
) -> None:
    """Each gave the whole."""
    motor = '<motor gear="{}" joint="right_knee" name="{}"/>'
    text = mjcf_path(robot.description).read_text()
    both = motor.format(150, "right_knee") + motor.format(50, "second")
    (tmp_path / "two.xml").write_text(text.replace(motor.format(200, "right_knee"), both))
    two = load_robot(replace(robot.description, mjcf=str(tmp_path / "two.xml")))
    lead, hinge = lead_of(two, sway, AHEAD), Motors.of(two.model).hinge
    assert lead is not None
    (kp, kd), speed = gains(two, AHEAD), np.asarray(sway.qvel)[:, 6:][:, hinge]
    knees = hinge == robot.joint_names.index("right_knee")
    assert knees.sum() == 2
    given = (kp * lead - kd * speed)[:, knees].sum(1)
    np.testing.assert_allclose(given, torques(robot, sway)[:, hinge[knees][0]], atol=1e-9)


def test_without_it_nothing_leads(robot: Robot, sway: ReferenceMotion) -> None:
    assert lead_of(robot, sway, ControlConfig()) is None


@pytest.mark.parametrize("share", [1.0])
def test_a_replay_keeps_closer_to_the_reference(
    robot: Robot, sway: ReferenceMotion, share: float
) -> None:
    errors = []
    for control in (ControlConfig(), ControlConfig(feedforward=share)):
        clip = Clip(sway, lead_of(robot, sway, control))
        at = clip.at(np.zeros(1, int))
        replay = Driver(control, lambda sim, following, *rest: sim.reference_angles(following))
        starts = Starts(np.zeros(1, int), at.qpos, at.qvel)
        done = roll_out(robot, clip, replay, starts, np.full(1, 30), 1, Fall.of(robot))
        errors.append(np.abs(done.qpos[..., 7:] - done.target_qpos[..., 7:]).mean())
    assert errors[1] < 0.7 * errors[0]


def test_a_robot_names_its_own_share(robot: Robot, sway: ReferenceMotion) -> None:
    leading = load_robot(replace(robot.description, feedforward=0.5))
    half, whole = (lead_of(leading, sway, control) for control in (ControlConfig(), AHEAD))
    assert half is not None
    assert whole is not None
    np.testing.assert_allclose(half, 0.5 * whole)
    assert lead_of(leading, sway, ControlConfig(feedforward=0.0)) is None
    assert resolved(ControlConfig(), leading).feedforward == 0.5
