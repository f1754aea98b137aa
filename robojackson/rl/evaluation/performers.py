"""Robots that perform a programme, and where each of them is in it."""

import copy
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int

from robojackson.geometry.rotations import heading, wrapped
from robojackson.motion.floor_move import FloorMove
from robojackson.retarget.performance.programme import Part, Programme
from robojackson.rl.config.performance_config import PerformanceConfig
from robojackson.rl.sim.reference_clip import Clip, ClipStep
from robojackson.rl.sim.simulation import Simulation
from robojackson.rl.trackers.tracker import Follower, Tracker, TrackerInput
from robojackson.robot.fall import Fall, alignment


class Stage:
    """Step of the programme of each robot, and its place on the floor.

    Attributes:
        step: Current step of the programme of each.
        waits: Whether each has given up its part and stands until it is calm.
        aside: Velocity that is added to the programme's as trackers see it, in its frame, m/s:
            robots step in that direction.
        placed: Transforms from the programme's frame into the world.
        carried: Number of times that each was carried off within a part.
        given_up: Parts that each gave up.
    """

    def __init__(self, n: int, config: PerformanceConfig, programme: Programme) -> None:
        self._config, self._parts = config, programme.parts
        self._starts = np.array([part.start for part in programme.parts])
        self._last = len(programme.motion) - 1
        self._calm, self._needed = np.zeros(n, int), round(config.calm_s / programme.motion.dt)
        self.step, self.waits = np.zeros(n, int), np.zeros(n, bool)
        self._jumped = np.zeros(n, bool)
        self.aside, self._left = np.zeros((n, 2)), np.zeros(n, int)
        self.placed, self.carried = FloorMove.none(n), np.zeros(n, int)
        self.given_up: list[list[str]] = [[] for _ in range(n)]

    def copied(self) -> "Stage":
        """Return a stage that goes on by itself; what robots give up there is not recorded."""
        other = copy.copy(self)
        other.step, other.waits = self.step.copy(), self.waits.copy()
        other._jumped = self._jumped.copy()
        other.aside, other._left = self.aside.copy(), self._left.copy()
        other.carried, other.given_up = self.carried.copy(), [[] for _ in self.given_up]
        return other

    def ahead(self, k: int) -> Int[np.ndarray, " N"]:
        """Return the steps k further on; a robot that waits stays where it is."""
        return np.where(self.waits, self.step, np.minimum(self.step + k, self._last))

    def advance(self) -> None:
        """Advance by one control step."""
        self.step = self.ahead(1)
        self._left = np.maximum(self._left - 1, 0)
        self.aside = np.where(self._left[:, None] > 0, self.aside, 0.0)

    def place(self, qpos: Float[np.ndarray, "N nq"], now: Float[np.ndarray, "N nq"]) -> None:
        """Put the programme, whose states are `now`, under robots that start a part or were carried
        off."""
        there, config = self.placed.qpos(now), self._config
        apart = np.linalg.norm(qpos[:, :2] - there[:, :2], axis=-1)
        turned = np.abs(wrapped(heading(qpos[:, 3:7]) - heading(there[:, 3:7])))
        begins = np.isin(self.step, self._starts) | self.waits | self._jumped
        self._jumped[:] = False
        off = ((apart > config.carried_m) | (turned > config.turned_rad)) & ~begins
        self.carried += off
        new, old, which = FloorMove.onto(now, qpos), self.placed, begins | off
        self.placed = FloorMove(
            np.where(which, new.turn, old.turn), np.where(which[:, None], new.shift, old.shift)
        )

    def rest(self, tilt: Float[np.ndarray, " N"]) -> None:
        """Let robots that have stood upright for long enough go on with the next part."""
        self._calm = np.where(self.waits & (tilt < self._config.calm_rad), self._calm + 1, 0)
        self.waits = self.waits & (self._calm < self._needed)

    def give_up(self, which: Bool[np.ndarray, " N"]) -> None:
        """Let robots stand instead of the rest of their part."""
        for i in np.flatnonzero(which & ~self.waits):
            part = self._part(i)
            self.waits[i], self.step[i] = True, part.end - 1
            self.given_up[i].append(part.name)

    def jump(self, which: Bool[np.ndarray, " N"], steps: int) -> None:
        """Let robots go on so many steps further on, or back, in the same part."""
        for i in np.flatnonzero(which & ~self.waits):
            part = self._part(i)
            self.step[i] = np.clip(self.step[i] + steps, part.start, part.end - 1)
            self._jumped[i] = True

    def step_aside(
        self, which: Bool[np.ndarray, " N"], velocity: Float[np.ndarray, " 2"], steps: int
    ) -> None:
        """Let robots see a programme that travels with another velocity for so many steps."""
        self.aside = np.where(which[:, None], velocity, self.aside)
        self._left = np.where(which, steps, self._left)

    def seen(self, clip: Clip, k: int) -> ClipStep:
        """Return the programme k steps further on, as trackers see it."""
        step = clip.at(self.ahead(k))
        if not self.aside.any():
            return step
        qvel = step.qvel.copy()
        qvel[:, :2] += self.aside
        return replace(step, qvel=qvel)

    def _part(self, robot: int | np.integer) -> Part:
        return next(part for part in self._parts if self.step[robot] < part.end)


@dataclass(frozen=True)
class Moment:
    """N robots after a control step, in the frame of the programme.

    Attributes:
        qpos, points: States and keypoint sites.
        tilt: Angles between the robots' up axes and the programme's, rad.
        down: Whether each has fallen, or its simulation diverged.
    """

    qpos: Float[np.ndarray, "N nq"]
    points: Float[np.ndarray, "N K 3"]
    tilt: Float[np.ndarray, " N"]
    down: Bool[np.ndarray, " N"]


@dataclass(frozen=True)
class Performers:
    """N robots, what drives them and where each is."""

    tracker: Tracker
    follower: Follower
    clip: Clip
    sim: Simulation
    fall: Fall
    stage: Stage

    def step(self, up: Bool[np.ndarray, " N"]) -> Moment:
        """Run one control step of the robots that are up."""
        stage, clip, sim = self.stage, self.clip, self.sim
        stage.place(sim.qpos, clip.at(stage.step).qpos)
        own = stage.placed.inverse()
        window = tuple(stage.seen(clip, k) for k in self.tracker.window)
        qpos, qvel = sim.sensed()
        seen = TrackerInput(own.qpos(qpos), own.qvel(qvel), own.points(sim.points), window)
        sim.step(self.follower.targets(seen), up)
        stage.advance()
        following, there = clip.at(stage.step).qpos, own.qpos(sim.qpos)
        down = self.fall.has_fallen(there, following) | sim.broken
        tilt: np.ndarray = np.arccos(np.clip(alignment(there, following), -1.0, 1.0))
        return Moment(there, own.points(sim.points), tilt, down)

    def copied(self, sim: Simulation, rows: Bool[np.ndarray, " N"]) -> "Performers":
        """Return these robots as they are now, some of them simulated by another simulation."""
        (which,) = np.nonzero(rows)
        sim.place(which, self.sim.qpos[which], self.sim.qvel[which])
        return replace(self, sim=sim, follower=copy.copy(self.follower), stage=self.stage.copied())
