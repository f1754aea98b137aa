"""Varied physics, late actions, noisy sensors and pushes."""

import dataclasses

import mujoco
import numpy as np
import pytest

from robojackson.errors import BadConfiguration
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.rl.config.train_config import ControlConfig, RandomConfig, TrackConfig
from robojackson.rl.env.tracking_core import TrackingCore
from robojackson.rl.sim.disturbances import PUSH, PUSH_EVERY_S
from robojackson.rl.sim.simulation import Simulation
from robojackson.rl.sim.variation import Variation, varied, varied_models
from robojackson.robot.model import Robot
from tests.fixtures.resumed_environments import require_the_same_after_resuming

N = 4


def placed(robot: Robot, random: RandomConfig, delay_s: float = 0.0, seed: int = 0) -> Simulation:
    sim = Simulation(robot, ControlConfig(), N, random=random, seed=seed, delay_s=delay_s)
    qpos = np.tile(robot.standing, (N, 1))
    sim.place(np.arange(N), qpos, np.zeros((N, robot.model.nv)))
    return sim


def test_a_heavier_robot_weighs_more_and_the_stock_one_stays(robot: Robot) -> None:
    stock = robot.model.body_mass.sum()
    heavy = varied(robot, Variation(mass=1.1, friction=0.5, com=(0.02, 0.0, 0.0)))
    assert heavy.model.body_mass.sum() == pytest.approx(1.1 * stock)
    np.testing.assert_allclose(heavy.model.geom_friction, 0.5 * robot.model.geom_friction)
    root = robot.model.body(robot.description.root_body).id
    moved = heavy.model.body_ipos[root] - robot.model.body_ipos[root]
    np.testing.assert_allclose(moved, [0.02, 0.0, 0.0])
    assert robot.model.body_mass.sum() == stock
    ratio = heavy.model.dof_invweight0[0] / robot.model.dof_invweight0[0]
    assert ratio == pytest.approx(1 / 1.1, rel=0.05), "what follows from masses is computed anew"


@pytest.mark.parametrize(
    ("random", "models"),
    [
        (RandomConfig(pushes=1.0, sensor_noise=1.0, gains=0.1, delay=0.02), 1),
        (RandomConfig(friction=0.1), N),
        (RandomConfig(integrators=("Euler",)), N),
    ],
)
def test_robots_share_a_model_where_nothing_of_it_varies(
    random: RandomConfig, models: int, robot: Robot
) -> None:
    """A copy of the G1's takes 68 MB."""
    found = varied_models(robot, random, N, np.random.default_rng(0))
    assert len(found) == N
    assert len({id(model) for model in found}) == models


def test_graded_ranges_grow_from_the_stock_robot_to_whole_ones(robot: Robot) -> None:
    """With the same random numbers robot i is i / (n - 1) as far from the stock robot."""
    whole, graded = (
        RandomConfig(friction=0.5, mass=0.1, gains=0.2, sensor_noise=1.0, least=least)
        for least in (1.0, 0.0)
    )
    share = np.linspace(0, 1, N)
    friction, mass = [], []
    for random in (whole, graded):
        models = varied_models(robot, random, N, np.random.default_rng(0))
        friction.append([m.geom_friction[0, 0] / robot.model.geom_friction[0, 0] for m in models])
        mass.append([m.body_mass.sum() / robot.model.body_mass.sum() for m in models])
    for wide, narrow in (friction, mass):
        np.testing.assert_allclose(np.array(narrow) - 1, share * (np.array(wide) - 1), atol=1e-12)
    first, second = placed(robot, whole), placed(robot, graded)
    stock = placed(robot, RandomConfig()).kp
    np.testing.assert_allclose(second.kp - stock, share[:, None] * (first.kp - stock), atol=1e-12)
    noise = [sim.sensed()[1] - sim.qvel for sim in (first, second)]
    np.testing.assert_allclose(noise[1], share[:, None] * noise[0], atol=1e-12)


def test_graded_pushes_and_delays_leave_the_first_robot_alone(robot: Robot) -> None:
    calm, pushed = (placed(robot, RandomConfig(pushes=p, least=0.0)) for p in (0.0, 1.0))
    hold = np.tile(robot.standing[7:][calm.motors.hinge], (N, 1))
    for _ in range(int(3.2 / calm.dt)):
        calm.step(hold)
        pushed.step(hold)
    apart = np.abs(pushed.qpos - calm.qpos).max(1)
    assert apart[0] == 0
    assert apart[1:].min() > 0
    step = float(robot.model.opt.timestep)
    late = [placed(robot, RandomConfig(delay=5 * step, least=least))._delay for least in (1, 0)]
    np.testing.assert_array_equal(late[1], np.round(np.linspace(0, 1, N) * late[0]))
    assert late[0].max() > 0


def test_another_time_step_keeps_the_control_step(robot: Robot) -> None:
    fine = varied(robot, Variation(timestep=0.0015))
    assert fine.substeps == 10
    with pytest.raises(BadConfiguration, match="divide"):
        varied(robot, Variation(timestep=0.004))


def test_an_action_that_comes_a_control_step_late_is_the_one_before(robot: Robot) -> None:
    """Late by a whole step, the robot does what a prompt one does with the older targets."""
    late, prompt = (placed(robot, RandomConfig(), delay) for delay in (0.015, 0.0))
    hold = np.tile(robot.standing[7:][late.motors.hinge], (N, 1))
    rng = np.random.default_rng(0)
    targets = hold + rng.uniform(-0.2, 0.2, (3, *hold.shape))
    for now, before in zip(targets, [hold, *targets[:-1]], strict=True):
        late.step(now)
        prompt.step(before)
        np.testing.assert_allclose(late.qpos, prompt.qpos, atol=1e-12)


@pytest.mark.parametrize("late", [1, 3])
def test_a_torque_that_comes_some_substeps_late_begins_there(late: int, robot: Robot) -> None:
    """Not a whole control step late, and after no torque, not one that is an angle."""
    control, substep_s = ControlConfig(law="torque"), float(robot.model.opt.timestep)
    sim = Simulation(robot, control, 1, delay_s=late * substep_s)
    qpos, model = robot.standing[None], robot.model
    sim.place(np.zeros(1, int), qpos, np.zeros((1, model.nv)))
    rng, before, data = np.random.default_rng(0), np.zeros(model.nu), mujoco.MjData(model)
    data.qpos[:] = qpos
    mujoco.mj_forward(model, data)
    for torque in rng.uniform(-0.3, 0.3, (3, model.nu)):
        sim.step(torque[None])
        for substep in range(sim.control.substeps or 1):
            data.ctrl[:] = before if substep < late else torque
            mujoco.mj_step(model, data)
        before = torque
        np.testing.assert_allclose(sim.qpos[0], data.qpos, atol=1e-12)


@pytest.mark.parametrize("late", [1, 3, 5])
def test_a_held_torque_is_computed_once_when_its_targets_arrive(late: int, robot: Robot) -> None:
    """And kept until the next ones do; a robot that was just placed holds its own angles."""
    control, substep_s = ControlConfig(law="hold"), float(robot.model.opt.timestep)
    sim = Simulation(robot, control, 1, delay_s=late * substep_s)
    model, motors, count = robot.model, sim.motors, sim.control.substeps or 1
    assert count == 5
    sim.place(np.zeros(1, int), robot.standing[None], np.full((1, model.nv), 0.1))
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:] = robot.standing, 0.1
    own = data.qpos[7:][motors.hinge].copy()

    def torque(targets: np.ndarray) -> np.ndarray:
        angles, speeds = data.qpos[7:][motors.hinge], data.qvel[6:][motors.hinge]
        wanted = sim.kp * (targets - angles) - sim.kd * speeds
        result: np.ndarray = np.clip(wanted, -motors.limit, motors.limit) / motors.gear
        return result

    rng, waiting = np.random.default_rng(0), {0: own}
    for number in range(3):
        targets = own + rng.uniform(-0.2, 0.2, model.nu)
        waiting[number * count + late] = targets
        sim.step(targets[None])
        for substep in range(number * count, (number + 1) * count):
            if substep in waiting:
                data.ctrl[:] = torque(waiting[substep])
            mujoco.mj_step(model, data)
        np.testing.assert_allclose(sim.qpos[0], data.qpos, atol=1e-12)


def test_noise_is_within_its_bounds_and_the_same_within_a_step(robot: Robot) -> None:
    sim = placed(robot, RandomConfig(sensor_noise=1.0))
    qpos, qvel = sim.sensed()
    np.testing.assert_array_equal(qpos, sim.sensed()[0])
    off = np.abs(qpos[:, 7:] - sim.qpos[:, 7:])
    assert 0 < off.max() <= 0.01
    assert 0 < np.abs(qvel[:, 6:] - sim.qvel[:, 6:]).max() <= 0.5
    np.testing.assert_array_equal(qpos[:, :3], sim.qpos[:, :3])
    np.testing.assert_allclose(np.linalg.norm(qpos[:, 3:7], axis=1), 1.0)


def test_without_noise_sensors_are_exact(robot: Robot) -> None:
    sim = placed(robot, RandomConfig())
    assert sim.sensed()[0] is sim.qpos


def test_pushes_come_every_one_to_three_seconds(robot: Robot) -> None:
    """A push changes the root's velocity by more than a step does, never beyond mjlab's bounds."""
    calm, pushed = (placed(robot, RandomConfig(pushes=p)) for p in (0.0, 1.0))
    hold = np.tile(robot.standing[7:][calm.motors.hinge], (N, 1))
    times = []
    for step in range(int(3.2 / calm.dt)):
        before = pushed.push_at.copy()
        pushed.step(hold)
        times += [(step + 1) * calm.dt] * int((pushed.push_at != before).sum())
    first = sorted(times)[:N]
    assert PUSH_EVERY_S[0] - 0.02 <= first[0]
    assert len(times) >= N
    assert max(PUSH) < 1.0


def test_a_resumed_environment_goes_on_with_the_same_disturbances(
    robot: Robot, sway: ReferenceMotion
) -> None:
    random = RandomConfig(sensor_noise=1.0, pushes=1.0, delay=0.01, mass=0.1)
    config = dataclasses.replace(TrackConfig(), random=random)
    first, second = (TrackingCore(robot, sway, config, N, 3) for _ in range(2))
    actions = np.random.default_rng(1).uniform(-0.3, 0.3, (120, N, robot.model.nu))
    require_the_same_after_resuming(first, second, actions, 60)


def test_robots_with_seeds_of_their_own_are_pushed_as_each_would_be_alone(robot: Robot) -> None:
    pushes = RandomConfig(pushes=1.0)
    both = Simulation(robot, ControlConfig(), 2, random=pushes, seed=(3, 8))
    waits = [
        Simulation(robot, ControlConfig(), 1, random=pushes, seed=(seed,)).push_at[0]
        for seed in (3, 8)
    ]
    np.testing.assert_array_equal(both.push_at, waits)
    assert waits[0] != waits[1]
