"""A performance: many robots dance one programme from its first stand to its last, and are pushed.

The programme is planned once (`retarget.performance`). Every part begins at the robot's place and
heading, and after a push the rest of the part continues from there. A robot that is about to fall
stands, and continues with the next part. Trackers see everything in the frame of the programme.
"""

from collections.abc import Callable

import numpy as np
from jaxtyping import Float, Int
from pydantic import Field

from robojackson.config import config_dataclass
from robojackson.geometry.rotations import heading, wrapped
from robojackson.motion.floor_move import FloorMove
from robojackson.retarget.performance.programme import Programme
from robojackson.rl.config.train_config import RandomConfig
from robojackson.rl.evaluation.performance_record import Performance
from robojackson.rl.sim.preview import driven_clip
from robojackson.rl.sim.simulation import Simulation, require_same_clock
from robojackson.rl.trackers.tracker import Tracker, TrackerInput
from robojackson.robot.fall import Fall, up_axis
from robojackson.robot.model import Robot

LONGEST = 2.0
"""Multiple of the programme's length after which a robot that keeps giving up parts has failed."""


@config_dataclass
class PerformanceConfig:
    """Settings of a performance.

    Attributes:
        runs: Number of runs; they differ in the times and directions of pushes.
        seed: Seed of the first run; the others have the following ones.
        pushes: Pushes every 1 to 3 s, multiples of mjlab's, unitless; those of the passport are 1.
        carried_m, turned_rad: From the programme, beyond which a robot follows it from where it is
            on.
        lost_rad: Tilt away from the programme's, from which a robot gives a way, or the end of a
            dance, up and stands.
        lost_dancing_rad: The same of a dance and what leads into it.
        calm_rad: Tilt away from the stand, below which for `calm_s` it goes on with the next part.
        threads: Threads that step the simulations.
    """

    runs: int = Field(default=8, ge=1)
    seed: int = Field(default=0, ge=0)
    pushes: float = Field(default=1.0, ge=0, le=10)
    carried_m: float = Field(default=0.3, gt=0)
    turned_rad: float = Field(default=0.5, gt=0)
    lost_rad: float = Field(default=0.3, gt=0)
    lost_dancing_rad: float = Field(default=0.45, gt=0)
    calm_rad: float = Field(default=0.15, gt=0)
    calm_s: float = Field(default=1.0, gt=0)
    threads: int = Field(default=2, ge=1)


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
    follower, fall, stage = tracker.follow(robot, n), Fall.of(robot), _Stage(n, config, programme)
    up, length, fell = np.ones(n, bool), np.zeros(n, int), np.zeros(n, bool)
    record: list[tuple[np.ndarray, ...]] = []
    total = len(motion) - 1
    while up.any() and len(record) < LONGEST * total:
        stage.place(sim.qpos, clip.at(stage.step).qpos)
        own, window = stage.placed.inverse(), tuple(clip.at(stage.ahead(k)) for k in tracker.window)
        qpos, qvel = sim.sensed()
        seen = TrackerInput(own.qpos(qpos), own.qvel(qvel), own.points(sim.points), window)
        sim.step(follower.targets(seen), up)
        stage.advance()
        following, there = clip.at(stage.step).qpos, own.qpos(sim.qpos)
        down = up & (fall.has_fallen(there, following) | sim.broken)
        fell |= down
        up = up & ~down
        length += up
        arrays = stage.step, stage.waits, sim.qpos, own.points(sim.points), there[:, :3]
        record.append(tuple(array.copy() for array in arrays))
        up = up & (stage.waits | (stage.step < total))
        stage.watch(there, following, up)
        progress(min(int(stage.step.max()), total), total)
    sim.close()
    fell |= up  # one that never comes to rest again
    step, waits, own_qpos, points, roots = (np.stack(one) for one in zip(*record, strict=True))
    given_up = tuple(map(tuple, stage.given_up))
    figures = (step, waits, own_qpos, points, roots, stage.carried, given_up)
    return Performance(programme, length, fell, *figures)


class _Stage:
    """Step of the programme of each robot, and its place on the floor.

    Attributes:
        step: Current step of the programme of each.
        waits: Whether each has given up its part and stands until it is calm.
        placed: Transforms from the programme's frame into the world.
        carried: Number of times that each was carried off within a part.
        given_up: Parts that each gave up.
    """

    def __init__(self, n: int, config: PerformanceConfig, programme: Programme) -> None:
        self._config, self._parts = config, programme.parts
        self._starts = np.array([part.start for part in programme.parts])
        self._lost = np.full(len(programme.motion), config.lost_rad)
        for part in (part for part in programme.parts if part.is_dance):
            self._lost[part.start : part.danced[1]] = config.lost_dancing_rad
        self._last = len(programme.motion) - 1
        self._calm, self._needed = np.zeros(n, int), round(config.calm_s / programme.motion.dt)
        self.step, self.waits = np.zeros(n, int), np.zeros(n, bool)
        self.placed, self.carried = FloorMove.none(n), np.zeros(n, int)
        self.given_up: list[list[str]] = [[] for _ in range(n)]

    def ahead(self, k: int) -> Int[np.ndarray, " N"]:
        """Return the steps k further on; a robot that waits stays where it is."""
        return np.where(self.waits, self.step, np.minimum(self.step + k, self._last))

    def advance(self) -> None:
        """Advance by one control step."""
        self.step = self.ahead(1)

    def place(self, qpos: Float[np.ndarray, "N nq"], now: Float[np.ndarray, "N nq"]) -> None:
        """Put the programme, whose states are `now`, under robots that start a part or were carried
        off."""
        there, config = self.placed.qpos(now), self._config
        apart = np.linalg.norm(qpos[:, :2] - there[:, :2], axis=-1)
        turned = np.abs(wrapped(heading(qpos[:, 3:7]) - heading(there[:, 3:7])))
        begins = np.isin(self.step, self._starts) | self.waits
        off = ((apart > config.carried_m) | (turned > config.turned_rad)) & ~begins
        self.carried += off
        new, old, which = FloorMove.onto(now, qpos), self.placed, begins | off
        self.placed = FloorMove(
            np.where(which, new.turn, old.turn), np.where(which[:, None], new.shift, old.shift)
        )

    def watch(
        self, qpos: Float[np.ndarray, "N nq"], now: Float[np.ndarray, "N nq"], up: np.ndarray
    ) -> None:
        """Abandon a part where a robot is about to fall; continue where one is at rest."""
        along = np.sum(up_axis(qpos[:, 3:7]) * up_axis(now[:, 3:7]), -1)
        tilt = np.arccos(np.clip(along, -1.0, 1.0))
        self._calm = np.where(self.waits & (tilt < self._config.calm_rad), self._calm + 1, 0)
        self.waits = self.waits & (self._calm < self._needed)
        for i in np.flatnonzero(up & ~self.waits & (tilt > self._lost[self.step])):
            part = next(part for part in self._parts if self.step[i] < part.end)
            self.waits[i], self.step[i] = True, part.end - 1
            self.given_up[i].append(part.name)
