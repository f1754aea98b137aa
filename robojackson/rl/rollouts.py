"""Rollouts of many starts at once on stock physics, recorded until each robot falls."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from robojackson.retarget.robot import Robot
from robojackson.rl.clip import Clip
from robojackson.rl.config import ControlConfig, TerminationConfig
from robojackson.rl.observation import observe
from robojackson.rl.physics import Simulation
from robojackson.rl.rewards import fallen

Controller = Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]
"""(observation (N, D), hinge angles of the next reference step (N, J), start step (N,)) -> target
hinge angles (N, J), radians."""


@dataclass(frozen=True)
class Starts:
    """States to start from: the clip step each belongs to and the state itself."""

    step: Int[np.ndarray, " N"]
    qpos: Float[np.ndarray, "N nq"]
    qvel: Float[np.ndarray, "N nv"]


@dataclass(frozen=True)
class Rollouts:
    """What N robots did; after its fall a robot's rows repeat the last state.

    Attributes:
        length: Steps each survived, at most H.
        fell: Whether each fell before the horizon.
        horizon: Steps that each was asked for.
        qpos: States after every step.
        points: Keypoint sites, world, metres.
        wanted: The reference's sites at the same steps, world, metres.
        wanted_root: The reference's root orientation, quaternion wxyz.
    """

    length: Int[np.ndarray, " N"]
    fell: np.ndarray
    horizon: Int[np.ndarray, " N"]
    qpos: Float[np.ndarray, "H N nq"]
    points: Float[np.ndarray, "H N K 3"]
    wanted: Float[np.ndarray, "H N K 3"]
    wanted_root: Float[np.ndarray, "H N 4"]


def roll_out(
    robot: Robot,
    clip: Clip,
    control: ControlConfig,
    controller: Controller,
    starts: Starts,
    horizon: Int[np.ndarray, " N"],
    threads: int,
    rules: TerminationConfig,
    tick: Callable[[int, int], None] = lambda step, total: None,
) -> Rollouts:
    """Run a controller from every start, each to its own horizon or its fall."""
    n, steps = len(starts.step), int(horizon.max())
    sim = Simulation(robot, control, n, threads)
    sim.place(np.arange(n), starts.qpos, starts.qvel)
    hinge = sim.motors.hinge
    action = np.zeros((n, len(hinge)))
    alive, length = np.ones(n, bool), np.zeros(n, int)
    record: list[tuple[np.ndarray, ...]] = []
    for t in range(steps):
        target = clip.at(starts.step + t + 1)
        seen = observe(sim.qpos, sim.qvel, sim.points, target, action)
        wish = controller(seen, target.qpos[:, 7:], starts.step)
        action = np.clip((wish - target.qpos[:, 7:])[:, hinge] / sim.residual, -1, 1)
        sim.step(wish[:, hinge], alive)
        alive = alive & ~fallen(sim.qpos, rules) & ~sim.broken & (t < horizon)
        length += alive
        record.append((sim.qpos.copy(), sim.points.copy(), target.points, target.qpos[:, 3:7]))
        tick(t + 1, steps)
        if not (alive & (t + 1 < horizon)).any():
            break
    sim.close()
    qpos, points, wanted, root = (np.stack(column) for column in zip(*record, strict=True))
    return Rollouts(length, length < horizon, horizon, qpos, points, wanted, root)
