"""Gains that swing a hinge up within the steps of the physics are named and not trained with."""

import copy
from dataclasses import replace

import mujoco
import numpy as np
import pytest

from robojackson.errors import BadConfiguration
from robojackson.pipeline.robot_descriptions import describe_robot, robot_names
from robojackson.rl.config.train_config import ControlConfig, TrackConfig, TrainConfig
from robojackson.rl.modes.reset_states import default_standing_pose
from robojackson.rl.sim.simulation import Simulation
from robojackson.rl.sim.trainable import require_trainable
from robojackson.robot.description import RobotDescription
from robojackson.robot.description_check import hinge_inertia, problems, unstable_gains
from robojackson.robot.mjcf import mjcf_path
from robojackson.robot.model import Robot, load_robot

STAND_S = {"humanoid": 0.7}
"""How long a robot stands without shaking, a second where none is named. With Humanoid-v5's gains,
on which all published figures rest, the hips of that stand are at the limit (2.02): their shaking
grows until it saturates after .8 s."""
NOW = describe_robot("humanoid_strong")
STRONG = replace(NOW, damping={key: 0.1 * value for key, value in NOW.stiffness.items()})
"""As it shipped: three times the damping of Humanoid-v5, a tenth of the stiffness."""


def shipped(name: str) -> Robot:
    """Return a robot of configs/robots whose model is here."""
    try:
        mjcf_path(describe_robot(name))
    except BadConfiguration as cause:
        pytest.skip(str(cause))
    return load_robot(describe_robot(name))


def saturated(robot: Robot, seconds: float) -> float:
    """Return the largest share of motors at their limits while the robot holds its stand."""
    sim, pose = Simulation(robot, ControlConfig(), 1), default_standing_pose(robot)
    sim.place(np.zeros(1, int), pose[None], np.zeros((1, robot.model.nv)))
    shares = []
    for _ in range(round(seconds / sim.dt)):
        sim.step(pose[7:][sim.motors.hinge][None])
        torque = np.abs(sim.datas[0].ctrl * sim.motors.gear)
        shares.append(float((torque >= 0.99 * sim.motors.limit).mean()))
    return max(shares)


@pytest.mark.parametrize("name", robot_names())
def test_a_shipped_robot_has_stable_gains(name: str) -> None:
    robot = shipped(name)
    assert list(unstable_gains(robot)) == []
    require_trainable(robot)


@pytest.mark.parametrize("name", [n for n in robot_names() if not describe_robot(n).feedback])
def test_a_shipped_robot_without_feedback_holds_its_stand_without_shaking(name: str) -> None:
    assert saturated(shipped(name), STAND_S.get(name, 1.0)) == 0.0


def test_damping_beyond_the_limit_shakes_the_motors() -> None:
    assert saturated(load_robot(STRONG), 0.3) > 0.5


def test_the_strong_variant_stands_still_after_a_disturbance() -> None:
    """With the damping of Humanoid-v5 its hips turned at 15 rad/s."""
    robot, rng = load_robot(describe_robot("humanoid_strong")), np.random.default_rng(1)
    sim, pose = Simulation(robot, ControlConfig(), 1), default_standing_pose(robot)
    start = pose.copy()
    start[7:] += rng.normal(0, 0.02, robot.model.nu)
    sim.place(np.zeros(1, int), start[None], rng.normal(0, 0.1, (1, robot.model.nv)))
    for _ in range(40):
        sim.step(pose[7:][sim.motors.hinge][None])
    assert np.abs(sim.qvel[0, 6:]).max() < 0.5


def test_the_inertia_is_what_a_torque_on_the_hinge_alone_feels(robot: Robot) -> None:
    model = copy.copy(robot.model)
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
    data, found = mujoco.MjData(model), []
    for torque in np.eye(model.nv)[6:]:
        mujoco.mj_resetData(model, data)
        data.qpos[:] = robot.standing
        mujoco.mj_forward(model, data)
        before = data.qacc.copy()
        data.qfrc_applied[:] = torque
        mujoco.mj_forward(model, data)
        found.append(1.0 / ((data.qacc - before) @ torque))
    np.testing.assert_allclose(hinge_inertia(robot), found, rtol=1e-6)


def test_unstable_gains_are_a_problem_with_a_remedy() -> None:
    (line,) = problems(STRONG)
    assert "humanoid_strong.yaml: damping: the gains of 'right_hip_z' are unstable" in line
    assert "= 5.24, at most 2 is stable (6 hinges are above)" in line
    for word in ("armature (0.13 makes it 1)", "damping (9.2)", "simulation.timestep"):
        assert word in line
    with pytest.raises(
        BadConfiguration, match=r"training is not possible .* 'right_hip_z' are unst"
    ):
        require_trainable(load_robot(STRONG))


def test_the_gains_of_a_training_count_not_only_those_of_the_robot() -> None:
    """`--set track.control.damping` gave a robot what its YAML may not; torques need no gains."""
    shaking = TrackConfig(control=ControlConfig(stiffness=4.0, damping=0.1))
    with pytest.raises(BadConfiguration, match=r"yet: track\.control\.damping: .* = 5\.24"):
        require_trainable(load_robot(NOW), TrainConfig(steps=1, track=shaking))
    require_trainable(load_robot(STRONG), TrainConfig(steps=1, mode="paper"))


@pytest.mark.parametrize(
    "remedy",
    [
        {"armature": {"*": 0.13}},
        {"damping": {"*": 9.0}},
        {"simulation": replace(STRONG.simulation, timestep=0.001)},
    ],
)
def test_each_remedy_mends_the_gains(remedy: dict[str, object]) -> None:
    mended: RobotDescription = replace(STRONG, **remedy)  # type: ignore[arg-type]
    assert list(unstable_gains(load_robot(mended))) == []


def test_a_hinge_without_a_motor_has_no_gains() -> None:
    robot = load_robot(STRONG)
    idle = replace(robot.actuation, torque_limit=np.full(len(robot.joint_names), np.inf))
    assert list(unstable_gains(replace(robot, actuation=idle))) == []
