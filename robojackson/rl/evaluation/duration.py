"""Estimates of time on this machine: for an evaluation, and for a training."""

import time

import mujoco
import numpy as np

from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.rl.config.evaluate_config import EvaluateConfig
from robojackson.robot.model import Robot

LASTING, FALLING = 2, 4
"""Number of evaluated bodies: the trained one, a variant of it, and those that do not dance."""
FALLING_SHARE = 0.3
"""Time after which the bodies that do not dance lie on the floor, seconds."""
PASSPORT_CASES = 18
TIMED_STEPS = 400
AROUND_A_STEP = 1.6
"""Time of a simulated step with control and scoring, in multiples of MuJoCo's alone."""
CYCLIC_MINUTES, WALKING_MINUTES, OTHER_MINUTES = 10.0, 20.0, 20.0
"""Training times of Humanoid-v5 on the bundled hip_shake, the bundled walk, and dance_b or the
authors' walk, minutes of one core (docs/benchmarks_learning.md)."""
FED_MINUTES, FED_MINUTES_A_SECOND = 5.0, 1.0
"""Training time on top of the G1's feedback at least, and for every second of a motion that ends,
minutes of one core (docs/learning_g1.md, "In short")."""
CYCLIC_S, OTHER_S = 4.0, 11.0
"""Longest of these motions that repeat, and that end, seconds; longer ones take proportionally
longer."""
WALKS_M = 0.2
"""Path of a cycle above which a motion counts as walking, metres."""


def seconds_to_evaluate(robot: Robot, reference: ReferenceMotion, config: EvaluateConfig) -> float:
    """Return the approximate time of an evaluation, seconds; measured by a short simulation."""
    length = config.seconds if reference.cyclic else len(reference) * reference.dt
    starts = config.phases * config.resets + 1
    rollouts = (LASTING + FALLING_SHARE * FALLING) * starts
    if config.passport:
        rollouts += PASSPORT_CASES * (config.phases + 1)
    substeps = length / robot.model.opt.timestep
    return float(AROUND_A_STEP * rollouts * substeps * seconds_a_step(robot) / config.threads)


def seconds_a_step(robot: Robot) -> float:
    """Return the time of one step of the physics on this machine, seconds."""
    data = mujoco.MjData(robot.model)
    data.qpos[:] = robot.standing
    data.qpos[2] += 0.9
    times = []
    for _ in range(4):
        began = time.perf_counter()
        for _ in range(TIMED_STEPS // 4):
            mujoco.mj_step(robot.model, data)
        times.append((time.perf_counter() - began) * 4 / TIMED_STEPS)
    return float(np.median(times))


def minutes_needed(reference: ReferenceMotion, fed: bool = False) -> float:
    """Return the approximate training time until a robot dances this, minutes of one core.

    Estimated by kind and length of the motion from measured ones; not guaranteed.

    Args:
        fed: Whether the robot has feedback along the motion, whose search is not included, and is
            not pushed.
    """
    seconds = len(reference) * reference.dt
    if fed:
        return FED_MINUTES if reference.cyclic else max(FED_MINUTES, FED_MINUTES_A_SECOND * seconds)
    if not reference.cyclic:
        return OTHER_MINUTES * max(1.0, seconds / OTHER_S)
    walks = float(np.linalg.norm(reference.cycle_offset[:2])) > WALKS_M
    return (WALKING_MINUTES if walks else CYCLIC_MINUTES) * max(1.0, seconds / CYCLIC_S)
