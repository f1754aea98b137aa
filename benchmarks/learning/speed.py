"""Speed of learning beside its peers, interleaved in one process on one core, in CPU time, so that
a busy machine changes both alike; `threads` alone is wall time and needs two idle cores.
"""

import os
import time
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from benchmarks.learning.environment_core import core, humanoid, named
from robojackson.errors import BadConfiguration
from robojackson.pipeline.robot_descriptions import describe_robot
from robojackson.rl.config.train_config import ControlConfig, PaperConfig, TqcConfig, TrackConfig
from robojackson.rl.env.tracking_core import TrackingCore
from robojackson.rl.env.vec_env import TrackingVecEnv
from robojackson.rl.modes.standing_motion import make_standing_motion
from robojackson.rl.sim.simulation import Simulation
from robojackson.rl.tqc.replay_files import buffer_of
from robojackson.rl.tqc.trainers import make_trainer
from robojackson.robot.mjcf import mjcf_path

Row = dict[str, Any]


def speed(repeats: int, seconds: float) -> list[Row]:
    """Return one row a comparison: ours, the peer's, their ratio and the bar."""
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    rows = [updates(repeats, seconds, layer_norm) for layer_norm in (False, True)]
    rows += [paper_steps(repeats, seconds), *cores(repeats)]
    return [{**row, "load_average": os.getloadavg()[0]} for row in rows]


def updates(repeats: int, seconds: float, layer_norm: bool) -> Row:
    """Return the gradient updates a CPU second at equal hyper-parameters, on the tracking
    observation: as sb3-contrib's critics are, and as ours are by default."""
    tqc = TqcConfig(policy_delay=1, warmup=1, layer_norm=layer_norm)
    work = {name: _rounds(name, TrackConfig(threads=1), tqc) for name in ("sbx", "sb3")}
    ours, theirs = interleaved(work, repeats, seconds)
    what = "updates/s, sbx over sb3-contrib" + ", layer normalisation" * layer_norm
    return comparison(what, ours, theirs, ours / theirs, ">= 4")


def paper_steps(repeats: int, seconds: float) -> Row:
    """Return CPU seconds a step of paper mode: 348 observations, one update a step, same
    networks."""
    tqc = TqcConfig(preset="paper", warmup=1)
    work = {name: _rounds(name, PaperConfig(), tqc, step=True) for name in ("sbx", "sb3")}
    ours, theirs = (1 / rate for rate in interleaved(work, repeats, seconds))
    what = "paper mode, CPU s a step, sbx over sb3-contrib"
    return comparison(what, ours, theirs, ours / theirs, "<= 0.45")


def _rounds(
    trainer_name: str, environment: TrackConfig | PaperConfig, tqc: TqcConfig, step: bool = False
) -> Callable[[], int]:
    """Return a function that does one round (with steps, if requested) and returns its updates."""
    robot = humanoid()
    env = TrackingVecEnv(
        TrackingCore(robot, make_standing_motion(robot), environment, tqc.n_envs, 0)
    )
    trainer = make_trainer(trainer_name, env, tqc, seed=0)
    model: Any = trainer.model  # type: ignore[attr-defined]
    rng = np.random.default_rng(0)
    seen: Any = env.reset()
    buffer = buffer_of(model)

    def act(action: np.ndarray) -> None:
        nonlocal seen
        after: Any
        after, reward, done, infos = env.step(action)
        buffer.add(seen, after, action, reward, done, infos)
        seen = after

    for _ in range(256):
        act(rng.uniform(-1, 1, (tqc.n_envs, env.core.action_size)))

    def one_round() -> int:
        for _ in range(tqc.steps_per_round if step else 0):
            act(model.predict(seen, deterministic=False)[0])
        model.train(tqc.updates_per_round, tqc.batch)
        if trainer_name == "sbx":
            import jax

            jax.block_until_ready(trainer._state())  # type: ignore[attr-defined, no-untyped-call]
        return tqc.updates_per_round

    one_round()
    return one_round


def interleaved(
    work: Mapping[str, Callable[[], int]], repeats: int, seconds: float
) -> tuple[float, ...]:
    """Return the units a CPU second of each, turn by turn; the median over turns."""
    rates: dict[str, list[float]] = {name: [] for name in work}
    for _ in range(repeats):
        for name, one_round in work.items():
            began, done = time.process_time(), 0
            while time.process_time() - began < seconds:
                done += one_round()
            rates[name].append(done / (time.process_time() - began))
    return tuple(float(np.median(found)) for found in rates.values())


CORES = {"humanoid": ">= 0.88", "g1": ">= 0.85"}
"""Bars of the environment over a bare loop, by robot."""


def cores(repeats: int) -> list[Row]:
    """Return the row of every robot whose model is here."""
    return [core_row(repeats, name) for name in CORES if _is_here(name)]


def _is_here(robot: str) -> bool:
    try:
        return mjcf_path(describe_robot(robot)).is_file()
    except BadConfiguration:
        return False


def core_row(repeats: int, robot: str = "humanoid") -> Row:
    """Return the substeps a CPU second of the whole environment over a bare mj_step loop, same
    physics.

    `ratio_batched` stands beside it: over a bare loop in the order of our batches.
    """
    speeds = core(repeats, robot=named(robot))
    what = "environment, substeps/s, over a bare mj_step loop"
    if robot != "humanoid":
        what = f"{what}, {robot}"
    row = comparison(what, speeds.ours, speeds.bare, speeds.ratio, CORES[robot])
    return {**row, "peer_batched": speeds.batched, "ratio_batched": speeds.ratio_batched}


def threads(repeats: int = 5, n: int = 32, steps: int = 100) -> Row:
    """Return the environment steps a second of two threads over one, wall time: two cores must be
    idle."""
    robot = humanoid()
    motion = make_standing_motion(robot)
    rates: dict[int, list[float]] = {1: [], 2: []}
    for _ in range(repeats):
        for count, found in rates.items():
            sim = Simulation(robot, ControlConfig(), n, count)
            sim.place(np.arange(n), np.repeat(motion.qpos[:1], n, 0), np.zeros((n, 23)))
            targets = np.repeat(motion.qpos[:1, 7:][:, sim.motors.hinge], n, 0)
            began = time.perf_counter()
            for _ in range(steps):
                sim.step(targets)
            found.append(n * steps / (time.perf_counter() - began))
            sim.close()
    one, two = (float(np.median(found)) for found in rates.values())
    row = comparison(
        "environment steps/s, two threads over one (wall)", two, one, two / one, ">= 1.6"
    )
    return {**row, "load_average": os.getloadavg()[0]}


def comparison(name: str, ours: float, theirs: float, ratio: float, bar: str) -> Row:
    """Return a comparison as a row, and whether its bar holds."""
    word, limit = bar.split()
    holds = ratio >= float(limit) if word == ">=" else ratio <= float(limit)
    return {"what": name, "ours": ours, "peer": theirs, "ratio": ratio, "bar": bar, "holds": holds}
