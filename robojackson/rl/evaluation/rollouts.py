"""Rollouts of many starts at once on stock physics, recorded until each robot falls."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float, Int

from robojackson.rl.config.train_config import ControlConfig, RandomConfig
from robojackson.rl.sim.reference_clip import Clip, ClipStep
from robojackson.rl.sim.simulation import Simulation
from robojackson.robot.fall import Fall
from robojackson.robot.model import Robot

Reading = dict[str, Float[np.ndarray, " N"]]


@dataclass(frozen=True)
class Driver:
    """The control of robots in a rollout.

    Attributes:
        control: The law of control.
        command: (simulation, next step of the reference, start steps, last action) -> command of
            `Simulation.step`.
        repeats: Control steps for which a command is held.
    """

    control: ControlConfig
    command: Callable[[Simulation, ClipStep, np.ndarray, np.ndarray], np.ndarray]
    repeats: int = 1


@dataclass(frozen=True)
class Conditions:
    """Disturbances of a rollout.

    Attributes:
        random: Sensor noise, pushes and ranges of physics.
        delay_s: Delay of actions, s.
        seed: Seed of the random numbers.
    """

    random: RandomConfig = field(default_factory=RandomConfig)
    delay_s: float = 0.0
    seed: int = 0


@dataclass(frozen=True)
class Starts:
    """States to start from: the clip step each belongs to and the state itself."""

    step: Int[np.ndarray, " N"]
    qpos: Float[np.ndarray, "N nq"]
    qvel: Float[np.ndarray, "N nv"]


@dataclass(frozen=True)
class Moment:
    """Input of a meter after every control step.

    Attributes:
        sim: The simulation.
        at: The reference now.
        before: The sites one control step ago, world, m.
        change: Mean squared change of the action: of the residual, in units of a full one.
        fell: Robots that fell in this very step.
    """

    sim: Simulation
    at: ClipStep
    before: Float[np.ndarray, "N K 3"]
    change: Float[np.ndarray, " N"]
    fell: np.ndarray


@dataclass(frozen=True)
class Rollouts:
    """Records of N robots; after its fall a robot's rows repeat the last state, unless `whole`.

    Attributes:
        whole: Whether fallen robots were simulated on to their horizon.
        length: Steps each survived, at most H.
        fell: Whether each fell before the horizon.
        horizon: Requested steps of each.
        qpos: States after every step.
        points: Keypoint sites, world, metres.
        target: The reference's sites at the same steps, world, metres.
        target_qpos: The reference's state.
        totals: Sums of the meter's readings, up to the end or the fall, which is included.
    """

    length: Int[np.ndarray, " N"]
    fell: np.ndarray
    horizon: Int[np.ndarray, " N"]
    qpos: Float[np.ndarray, "H N nq"]
    points: Float[np.ndarray, "H N K 3"]
    target: Float[np.ndarray, "H N K 3"]
    target_qpos: Float[np.ndarray, "H N nq"]
    totals: Reading
    whole: bool = False


def roll_out(
    robot: Robot,
    clip: Clip,
    driver: Driver,
    starts: Starts,
    horizon: Int[np.ndarray, " N"],
    threads: int,
    fall: Fall,
    meter: Callable[[Moment], Reading] = lambda moment: {},
    tick: Callable[[int, int], None] = lambda step, total: None,
    whole: bool = False,
    conditions: Conditions | None = None,
) -> Rollouts:
    """Drive a robot from every start, each to its own horizon or its fall; with `whole` always to
    its horizon."""
    n, steps = len(starts.step), int(horizon.max())
    met = conditions or Conditions()
    sim = Simulation(robot, driver.control, n, threads, met.random, met.seed, met.delay_s)
    sim.place(np.arange(n), starts.qpos, starts.qvel)
    action = command = np.zeros((n, robot.model.nu))
    alive, length = np.ones(n, bool), np.zeros(n, int)
    totals: Reading = {}
    record: list[tuple[np.ndarray, ...]] = []
    for t in range(steps):
        target, before, change = clip.at(starts.step + t + 1), sim.points.copy(), np.zeros(n)
        if t % driver.repeats == 0:
            command = driver.command(sim, target, starts.step, action)
            residual = command - sim.reference_angles(target)
            last, action = action, np.clip(residual / sim.residual, -1, 1)
            change = np.mean((action - last) ** 2, -1)
        sim.step(command, t < horizon if whole else alive)
        still = alive & ~fall.has_fallen(sim.qpos, target.qpos) & ~sim.broken & (t < horizon)
        reading = meter(Moment(sim, target, before, change, alive & ~still & (t < horizon)))
        for name, value in reading.items():
            totals[name] = totals.get(name, 0.0) + np.where(alive & (t < horizon), value, 0.0)
        alive = still
        length += alive
        record.append((sim.qpos.copy(), sim.points.copy(), target.points, target.qpos))
        tick(t + 1, steps)
        if not ((alive | whole) & (t + 1 < horizon)).any():
            break
    sim.close()
    qpos, points, targets, target_qpos = (np.stack(column) for column in zip(*record, strict=True))
    return Rollouts(
        length, length < horizon, horizon, qpos, points, targets, target_qpos, totals, whole
    )
