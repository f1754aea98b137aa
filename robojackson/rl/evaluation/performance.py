"""A performance: many robots dance one programme from its first stand to its last, and are pushed.

The programme is planned once (`retarget.performance`). Every part begins at the robot's place and
heading, and after a push the rest of the part continues from there. A robot that is about to fall
stands, and continues with the next part. Trackers see everything in the frame of the programme.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int
from pydantic import Field
from typing_extensions import TypedDict

from robojackson.config import config_dataclass
from robojackson.geometry.rotations import heading, wrapped
from robojackson.metrics.joint_position_error import mpjpe
from robojackson.motion.floor_move import FloorMove
from robojackson.retarget.performance.programme import Part, Programme
from robojackson.rl.config.train_config import RandomConfig
from robojackson.rl.evaluation.rollout_records import SITES
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


class RunRow(TypedDict):
    """What became of a run; metres, seconds."""

    seed: int
    finished: bool
    survived_s: float
    fell_in: str
    given_up: str
    danced_share: float
    carried: int
    mpjpe_l_m: float
    away_m: float


class PartRow(TypedDict):
    """How many runs did a part, and how near they were; metres, seconds."""

    part: str
    is_dance: bool
    seconds: float
    infeasible_share: float
    began: int
    whole: int
    mpjpe_l_m: float | None


class Summary(TypedDict):
    """Counts and means over all runs; metres, seconds."""

    robot: str
    tracker: str
    pushes: float
    runs: int
    finished: int
    uninterrupted: int
    survived_s: float
    danced_share: float
    mpjpe_l_m: float


@dataclass(frozen=True)
class Performance:
    """Records of N robots in a programme, T control steps long.

    Attributes:
        programme: The programme.
        length: Number of steps that each was up, at most T.
        fell: Whether each fell.
        step: Step of the programme of each after every step.
        waits: Whether each had given up its part and stood.
        qpos: Their states, world; after the end of a run they repeat.
        points, target: Keypoints and those of the programme, in its frame, m.
        roots, target_roots: Positions of the roots and their targets, m.
        carried: Number of times that each continued from another place within a part.
        given_up: Names of the parts that each gave up.
    """

    programme: Programme
    length: Int[np.ndarray, " N"]
    fell: Bool[np.ndarray, " N"]
    step: Int[np.ndarray, "T N"]
    waits: Bool[np.ndarray, "T N"]
    qpos: Float[np.ndarray, "T N nq"]
    points: Float[np.ndarray, "T N K 3"]
    roots: Float[np.ndarray, "T N 3"]
    carried: Int[np.ndarray, " N"]
    given_up: tuple[tuple[str, ...], ...]

    def runs(self, seed: int) -> list[RunRow]:
        """Return a row a run, the first with this seed."""
        return [self._run(i, seed + i) for i in range(len(self.length))]

    def _run(self, i: int, seed: int) -> RunRow:
        parts, length = self.programme.parts, max(1, int(self.length[i]))
        dances = [part for part in parts if part.is_dance]
        danced = sum(int(self._shown(i, part).sum()) for part in dances)
        whole = sum(part.danced[1] - part.danced[0] for part in dances)
        last = self.step[length - 1, i]
        where = next(part.name for part in parts if last < part.end)
        return {
            "seed": seed,
            "finished": not bool(self.fell[i]),
            "survived_s": length * self.programme.motion.dt,
            "fell_in": where if self.fell[i] else "",
            "given_up": " ".join(self.given_up[i]),
            "danced_share": danced / whole,
            "carried": int(self.carried[i]),
            "mpjpe_l_m": self._error(i, ~self.waits[:length, i]),
            "away_m": float(np.linalg.norm(self.qpos[length - 1, i, :2] - self.qpos[0, i, :2])),
        }

    def parts(self) -> list[PartRow]:
        """Return a row a part: how many did it to its end, and how near they were."""
        return [self._part(part) for part in self.programme.parts]

    def _part(self, part: Part) -> PartRow:
        began, whole, errors = 0, 0, []
        for i in range(len(self.length)):
            rows = self._within(i, part)
            began += bool(rows.any())
            if rows.any() and (self.step[: self.length[i], i] >= part.end - 1).any():
                whole += not (self.waits[: len(rows), i] & self._steps_of(i, part)).any()
                errors.append(self._error(i, rows))
        return {
            "part": part.name,
            "is_dance": part.is_dance,
            "seconds": (part.end - part.start) * self.programme.motion.dt,
            "infeasible_share": part.infeasible_share,
            "began": began,
            "whole": whole,
            "mpjpe_l_m": float(np.mean(errors)) if errors else None,
        }

    def _steps_of(self, i: int, part: Part) -> Bool[np.ndarray, " L"]:
        step = self.step[: self.length[i], i]
        result: np.ndarray = (step >= part.start) & (step < part.end)
        return result

    def _within(self, i: int, part: Part) -> Bool[np.ndarray, " L"]:
        """Return when a run was in a part and had not given it up."""
        return np.asarray(self._steps_of(i, part) & ~self.waits[: self.length[i], i])

    def _shown(self, i: int, part: Part) -> Bool[np.ndarray, " L"]:
        step = self.step[: self.length[i], i]
        shows = (step >= part.danced[0]) & (step < part.danced[1])
        return np.asarray(shows & self._within(i, part))

    def _error(self, i: int, when: Bool[np.ndarray, " L"]) -> float:
        motion, rows = self.programme.motion, np.flatnonzero(when)
        at = self.step[rows, i]
        own = (self.points[rows, i, :SITES], np.asarray(motion.keypoints_w)[at, :SITES])
        return mpjpe(*own, self.roots[rows, i], motion.qpos[at, :3])


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
        """Give up a part where a robot is about to fall; continue where one is at rest."""
        along = np.sum(up_axis(qpos[:, 3:7]) * up_axis(now[:, 3:7]), -1)
        tilt = np.arccos(np.clip(along, -1.0, 1.0))
        self._calm = np.where(self.waits & (tilt < self._config.calm_rad), self._calm + 1, 0)
        self.waits = self.waits & (self._calm < self._needed)
        for i in np.flatnonzero(up & ~self.waits & (tilt > self._lost[self.step])):
            part = next(part for part in self._parts if self.step[i] < part.end)
            self.waits[i], self.step[i] = True, part.end - 1
            self.given_up[i].append(part.name)
