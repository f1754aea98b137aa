"""A performance: many robots dance one programme from its first stand to its last, and are pushed.

The programme is planned once (`retarget.performance`). Every part begins at the robot's place and
heading, and after a push the rest of the part continues from there. A robot that is about to fall,
also one that stands, does what keeps it up (`foresight`). Trackers see everything in the frame of
the programme.
"""

from collections.abc import Callable

import numpy as np

from robojackson.retarget.performance.programme import Programme
from robojackson.rl.config.performance_config import PerformanceConfig
from robojackson.rl.config.train_config import RandomConfig
from robojackson.rl.evaluation.foresight import Foresight
from robojackson.rl.evaluation.performance_record import Performance
from robojackson.rl.evaluation.performers import Performers, Stage
from robojackson.rl.feedback.driven_clip import driven_clip
from robojackson.rl.sim.simulation import Simulation, require_same_clock
from robojackson.rl.trackers.tracker import Tracker
from robojackson.robot.fall import Fall
from robojackson.robot.model import Robot

LONGEST = 2.0
"""Multiple of the programme's length after which a robot that keeps giving up parts has failed."""


def perform(
    tracker: Tracker,
    programme: Programme,
    robot: Robot,
    config: PerformanceConfig,
    progress: Callable[[int, int], None] = lambda step, total: None,
) -> Performance:
    """Let robots dance a programme.

    Raises:
        BadPolicy: the tracker is for another robot or another control step.
    """
    robot, motion, n = tracker.equip(robot), programme.motion, config.runs
    clip = driven_clip(robot, motion, tracker.control, tracker.sees_ahead)
    seeds, pushes = range(config.seed, config.seed + n), RandomConfig(pushes=config.pushes)
    sim = Simulation(robot, tracker.control, n, config.threads, pushes, seeds)
    require_same_clock(sim.dt, motion.dt)
    starts = np.repeat(np.asarray(motion.qpos[:1], float), n, 0)
    sim.place(np.arange(n), starts, np.zeros((n, robot.model.nv)))
    stage, foresight = Stage(n, config, programme), Foresight(robot, tracker, config)
    robots = Performers(tracker, tracker.follow(robot, n), clip, sim, Fall.of(robot), stage)
    up, length, fell = np.ones(n, bool), np.zeros(n, int), np.zeros(n, bool)
    record: list[tuple[np.ndarray, ...]] = []
    total, look = len(motion) - 1, max(1, round(config.look_s / motion.dt))
    while up.any() and len(record) < LONGEST * total:
        now = robots.step(up)
        fell |= up & now.down
        up = up & ~now.down
        length += up
        arrays = stage.step, stage.waits, sim.qpos, now.points, now.qpos[:, :3]
        record.append(tuple(array.copy() for array in arrays))
        up = up & (stage.waits | (stage.step < total))
        stage.rest(now.tilt)
        if len(record) % look == 0:
            doubted = up & (now.tilt > config.doubt_rad)
            foresight.choose(robots, doubted, look)
        progress(min(int(stage.step.max()), total), total)
    sim.close()
    foresight.close()
    fell |= up  # one that never comes to rest again
    step, waits, own_qpos, points, roots = (np.stack(one) for one in zip(*record, strict=True))
    given_up = tuple(map(tuple, stage.given_up))
    figures = (step, waits, own_qpos, points, roots, stage.carried, given_up)
    return Performance(programme, length, fell, *figures)
