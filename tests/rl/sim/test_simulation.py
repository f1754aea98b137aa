from dataclasses import replace
from pathlib import Path

import gymnasium
import mujoco
import numpy as np

from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.pipeline.robot_descriptions import describe_robot
from robojackson.rl.config.train_config import ControlConfig, RandomConfig
from robojackson.rl.sim.motors import Motors, residual_scale
from robojackson.rl.sim.robot_batch import Batch
from robojackson.rl.sim.simulation import Simulation
from robojackson.robot.model import Robot, load_robot
from tests.fixtures.own_robot import own_robot

SENSORS = """<sensor><framelinacc objtype="body" objname="torso"/>
<subtreeangmom body="torso"/></sensor></mujoco>"""


def placed(robot: Robot, sway: ReferenceMotion, n: int, threads: int) -> Simulation:
    sim = Simulation(robot, ControlConfig(), n, threads)
    sim.place(np.arange(n), sway.qpos[:n], sway.qvel[:n])
    return sim


def test_a_control_step_is_five_steps_of_gymnasiums_humanoid(
    robot: Robot, sway: ReferenceMotion
) -> None:
    env = gymnasium.make("Humanoid-v5", frame_skip=1).unwrapped
    env.reset(seed=0)
    env.set_state(sway.qpos[0], sway.qvel[0])
    env.data.qacc_warmstart[:] = 0
    sim = placed(robot, sway, 1, 1)
    target = sway.qpos[5, 7:]
    hinge, limit, gear = sim.motors.hinge, sim.motors.limit, sim.motors.gear
    for _ in range(5):
        torque = sim.kp * (target - env.data.qpos[7:])[hinge] - sim.kd * env.data.qvel[6:][hinge]
        env.step(np.clip(torque, -limit, limit) / gear)
    sim.step(target[None, hinge])
    np.testing.assert_allclose(sim.qpos[0], env.data.qpos, atol=1e-9)
    np.testing.assert_allclose(sim.qvel[0], env.data.qvel, atol=1e-8)


def test_the_model_is_the_stock_one_in_every_number_that_moves_it(robot: Robot) -> None:
    stock = gymnasium.make("Humanoid-v5", frame_skip=1).unwrapped.model
    for field in ("body_mass", "body_inertia", "geom_size", "geom_friction", "dof_damping",
                  "dof_armature", "jnt_range", "jnt_stiffness", "actuator_gear",
                  "actuator_ctrlrange"):  # fmt: skip
        np.testing.assert_array_equal(getattr(robot.model, field), getattr(stock, field), field)
    assert robot.model.opt.integrator == mujoco.mjtIntegrator.mjINT_RK4
    assert robot.model.opt.timestep == stock.opt.timestep == 0.003


def test_sensors_of_a_model_are_not_computed_and_move_nothing(
    robot: Robot, sway: ReferenceMotion, tmp_path: Path
) -> None:
    file = own_robot(tmp_path)
    model = tmp_path / "model.xml"
    model.write_text(model.read_text().replace("</mujoco>", SENSORS))
    sensing = load_robot(describe_robot(str(file)))
    sims = [placed(each, sway, 2, 1) for each in (robot, sensing)]
    for sim in sims:
        for step in range(5):
            sim.step(np.repeat(sway.qpos[step : step + 1, 7:][:, sim.motors.hinge], 2, 0))
    np.testing.assert_array_equal(sims[0].qpos, sims[1].qpos)
    np.testing.assert_array_equal(sims[0].qvel, sims[1].qvel)
    assert sensing.model.nsensor
    assert not sims[1].datas[0].sensordata.any()
    assert not sensing.model.opt.disableflags


def test_motors_in_the_order_of_the_hinges_follow_the_pd_law(
    robot: Robot, sway: ReferenceMotion
) -> None:
    sim, rng = placed(robot, sway, 2, 1), np.random.default_rng(3)
    motors = replace(sim.motors, hinge=np.arange(17))
    batch = Batch([sim.model] * 2, sim.datas, motors, sim.control, sim.kp, sim.kd)
    targets = sway.qpos[5:7, 7:] + rng.normal(0, 0.1, (2, 17))
    torque = (targets - sim.qpos[:, 7:]) * sim.kp - sim.qvel[:, 6:] * sim.kd
    result = np.clip(torque, -motors.limit, motors.limit) / motors.gear
    for _ in range(2):  # the memory that a call leaves is not read by the next
        np.testing.assert_array_equal(batch.controls(targets), result)


def test_threads_do_not_change_the_result(robot: Robot, sway: ReferenceMotion) -> None:
    one, two = placed(robot, sway, 6, 1), placed(robot, sway, 6, 2)
    targets = np.random.default_rng(0).uniform(-0.5, 0.5, (6, robot.model.nu))
    for _ in range(4):
        one.step(targets)
        two.step(targets)
    np.testing.assert_array_equal(one.qpos, two.qpos)


def test_the_torque_never_exceeds_the_stock_limit(robot: Robot, sway: ReferenceMotion) -> None:
    sim = placed(robot, sway, 2, 1)
    sim.step(np.full((2, robot.model.nu), 50.0))
    for data in sim.datas:
        assert np.abs(data.ctrl).max() <= 0.4 + 1e-12


def test_a_copy_that_is_not_active_stays(robot: Robot, sway: ReferenceMotion) -> None:
    sim = placed(robot, sway, 2, 1)
    sim.step(np.zeros((2, robot.model.nu)), np.array([True, False]))
    assert not np.allclose(sim.qpos[0], sway.qpos[0])
    np.testing.assert_array_equal(sim.qpos[1], sway.qpos[1])


def test_points_are_the_forward_kinematics_of_the_state(
    robot: Robot, sway: ReferenceMotion
) -> None:
    sim = placed(robot, sway, 1, 1)
    np.testing.assert_allclose(sim.points[0], sway.keypoints_w[0], atol=1e-12)


def test_every_motor_drives_the_hinge_of_its_own_name(robot: Robot) -> None:
    motors = Motors.of(robot.model)
    for actuator, hinge in enumerate(motors.hinge):
        assert robot.model.actuator(actuator).name == robot.joint_names[hinge]


def test_only_the_arms_get_the_small_residual(robot: Robot) -> None:
    scale = residual_scale(robot, ControlConfig(residual=0.5, arm_residual=0.2))
    arms = {robot.model.actuator(i).name for i in np.flatnonzero(scale == 0.2)}
    assert arms == {f"{side}_{joint}" for side in ("left", "right")
                    for joint in ("shoulder1", "shoulder2", "elbow")}  # fmt: skip


def test_a_residual_is_that_of_all_hinges_and_of_the_arms_too(robot: Robot) -> None:
    """The arms stayed at the robot's own action scale."""
    scale = residual_scale(robot, ControlConfig(residual=0.3))
    np.testing.assert_array_equal(scale, 0.3)
    own = robot.actuation.action_scale[Motors.of(robot.model).hinge]
    arms = residual_scale(robot, ControlConfig(arm_residual=0.2))
    np.testing.assert_array_equal(arms[arms != 0.2], own[arms != 0.2])


def test_a_held_torque_is_the_pd_law_at_the_first_substep(
    robot: Robot, sway: ReferenceMotion
) -> None:
    """As a plain `env.step` holds it for 15 ms."""
    stock = gymnasium.make("Humanoid-v5").unwrapped
    stock.reset(seed=0)
    stock.set_state(sway.qpos[0], sway.qvel[0])
    stock.data.qacc_warmstart[:] = 0
    sim = Simulation(robot, ControlConfig(law="hold"), 1)
    sim.place(np.arange(1), sway.qpos[:1], sway.qvel[:1])
    hinge, limit, target = sim.motors.hinge, sim.motors.limit, sway.qpos[5, 7:]
    torque = sim.kp * (target - sway.qpos[0, 7:])[hinge] - sim.kd * sway.qvel[0, 6:][hinge]
    stock.step(np.clip(torque, -limit, limit) / sim.motors.gear)
    sim.step(target[None, hinge])
    np.testing.assert_allclose(sim.qpos[0], stock.data.qpos, atol=1e-12)


def test_randomised_robots_differ_and_leave_the_stock_one_alone(
    robot: Robot, sway: ReferenceMotion
) -> None:
    stock = robot.model.geom_friction.copy()
    random = RandomConfig(friction=0.2, gains=0.1, integrators=("RK4", "implicitfast"))
    sim = Simulation(robot, ControlConfig(), 4, random=random, seed=1)
    sim.place(np.arange(4), sway.qpos[[0] * 4], sway.qvel[[0] * 4])
    for _ in range(4):
        sim.step(np.repeat(sway.qpos[:1, 7:][:, sim.motors.hinge], 4, 0))
    spread = np.ptp(sim.qpos, axis=0).max()
    assert 1e-6 < spread < 0.2
    np.testing.assert_array_equal(robot.model.geom_friction, stock)
    assert robot.model.opt.integrator == mujoco.mjtIntegrator.mjINT_RK4


def test_a_training_with_pushes_may_act_more_strongly(robot: Robot) -> None:
    stronger = load_robot(replace(robot.description, robust_action_factor=2.0))
    pushed, calm = RandomConfig(pushes=1.0), RandomConfig(friction=0.1)
    sims = [Simulation(stronger, ControlConfig(), 1, 1, random) for random in (pushed, calm)]
    np.testing.assert_allclose(sims[0].residual, 2 * sims[1].residual)
    np.testing.assert_array_equal(sims[1].residual, residual_scale(robot, ControlConfig()))
    kept = sims[0].control
    assert kept.action_factor == 2.0
    np.testing.assert_array_equal(residual_scale(stronger, kept), sims[0].residual)
