"""A performance: many robots dance one programme from its first stand to its last, and are pushed.

The programme is planned once (`retarget.performance`); where on the floor a robot follows it is the
robot's own matter. Every part begins where the robot is and faces, and where a push carries it off,
the rest of the part goes on from there. Trackers see everything in the frame of the programme.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int
from pydantic import Field

from robojackson.config import config_dataclass
from robojackson.geometry.rotations import heading, wrapped
from robojackson.metrics.joint_position_error import mpjpe
from robojackson.motion.floor_move import FloorMove
from robojackson.retarget.performance.programme import Part, Programme
from robojackson.rl.config.train_config import RandomConfig
from robojackson.rl.evaluation.rollout_records import SITES
from robojackson.rl.sim.preview import driven_clip
from robojackson.rl.sim.reference_clip import ClipStep
from robojackson.rl.sim.simulation import Simulation, require_same_clock
from robojackson.rl.trackers.tracker import Tracker, TrackerInput
from robojackson.robot.fall import Fall
from robojackson.robot.model import Robot


@config_dataclass
class PerformanceConfig:
    """How a performance is run.

    Attributes:
        runs: Runs; they differ in when and how the robot is pushed.
        seed: Of the first run; those after it have the seeds after it.
        pushes: Pushes every 1 to 3 s, multiples of mjlab's, unitless; those of the passport are 1.
        carried_m, turned_rad: From the programme, beyond which a robot follows it from where it is
            on.
        threads: Threads that step the simulations.
    """

    runs: int = Field(default=8, ge=1)
    seed: int = Field(default=0, ge=0)
    pushes: float = Field(default=1.0, ge=0, le=10)
    carried_m: float = Field(default=0.3, gt=0)
    turned_rad: float = Field(default=0.5, gt=0)
    threads: int = Field(default=2, ge=1)


@dataclass(frozen=True)
class Performance:
    """What N robots did with a programme of S steps.

    Attributes:
        programme: What they were to do.
        length: Steps that each stayed up, at most S - 1.
        qpos: Their states after every step, world; after a fall they repeat.
        points, target: Keypoints and those of the programme, in its frame, m.
        roots, target_roots: Places of the roots likewise, m.
        moved: Where on the floor each follows the programme at every step: m and rad.
        carried: How often each went on from another place within a part.
    """

    programme: Programme
    length: Int[np.ndarray, " N"]
    qpos: Float[np.ndarray, "S N nq"]
    points: Float[np.ndarray, "S N K 3"]
    target: Float[np.ndarray, "S K 3"]
    roots: Float[np.ndarray, "S N 3"]
    target_roots: Float[np.ndarray, "S 3"]
    carried: Int[np.ndarray, " N"]

    @property
    def finished(self) -> Bool[np.ndarray, " N"]:
        """Whether each was up at the end."""
        result: np.ndarray = self.length == len(self.qpos)
        return result

    def runs(self, seed: int) -> list[dict[str, object]]:
        """Return a row a run, the first with this seed."""
        parts, dt = self.programme.parts, self.programme.motion.dt
        rows: list[dict[str, object]] = []
        for i, length in enumerate(self.length):
            fell = not self.finished[i]
            where = next((part.name for part in parts if length < part.end), parts[-1].name)
            rows.append({
                "seed": seed + i,
                "finished": not fell,
                "survived_s": float(length * dt),
                "fell_in": where if fell else "",
                "carried": int(self.carried[i]),
                "mpjpe_l_m": self._error(i, slice(0, max(1, int(length)))),
                "walked_m": float(np.linalg.norm(self.qpos[-1, i, :2] - self.qpos[0, i, :2])),
            })  # fmt: skip
        return rows

    def parts(self) -> list[dict[str, object]]:
        """Return a row a part: who was up at its end, and how near those were that were."""
        return [self._part(part) for part in self.programme.parts]

    def _part(self, part: Part) -> dict[str, object]:
        rows = slice(part.start, min(part.end, len(self.qpos)))
        began, up = self.length >= part.start, self.length >= rows.stop
        errors = [self._error(int(i), rows) for i in np.flatnonzero(up)]
        return {
            "part": part.name,
            "seconds": (part.end - part.start) * self.programme.motion.dt,
            "infeasible_share": part.infeasible_share,
            "began": int(began.sum()),
            "stayed_up": int(up.sum()),
            "mpjpe_l_m": float(np.mean(errors)) if errors else None,
        }

    def _error(self, i: int, rows: slice) -> float:
        own = (self.points[rows, i, :SITES], self.target[rows, :SITES])
        return mpjpe(*own, self.roots[rows, i], self.target_roots[rows])


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
    seeds = range(config.seed, config.seed + n)
    pushes = RandomConfig(pushes=config.pushes)
    sim = Simulation(robot, tracker.control, n, config.threads, pushes, seeds)
    require_same_clock(sim.dt, motion.dt)
    starts = np.repeat(np.asarray(motion.qpos[:1], float), n, 0)
    sim.place(np.arange(n), starts, np.zeros((n, robot.model.nv)))
    follower, fall, stage = tracker.follow(robot, n), Fall.of(robot), _Stage(n, config)
    begins = {part.start for part in programme.parts}
    alive, length, record = np.ones(n, bool), np.zeros(n, int), []
    for t in range(len(motion) - 1):
        now, window = clip.at(np.full(n, t)), _window(clip.at, t, n, tracker.window)
        stage.follow(sim, now, everyone=t in begins)
        own = stage.placed.inverse()
        qpos, qvel = sim.sensed()
        seen = TrackerInput(own.qpos(qpos), own.qvel(qvel), own.points(sim.points), window)
        sim.step(follower.targets(seen), alive)
        following = clip.at(np.full(n, t + 1))
        there = own.qpos(sim.qpos)
        alive = alive & ~fall.has_fallen(there, following.qpos) & ~sim.broken
        length += alive
        record.append((sim.qpos.copy(), own.points(sim.points), there[:, :3]))
        progress(t + 1, len(motion) - 1)
        if not alive.any():
            break
    sim.close()
    states, points, roots = (np.stack(column) for column in zip(*record, strict=True))
    after = slice(1, len(states) + 1)
    target, target_roots = np.asarray(motion.keypoints_w)[after], motion.qpos[after, :3]
    return Performance(
        programme, length, states, points, target, roots, target_roots, stage.carried
    )


class _Stage:
    """Where on the floor each robot follows the programme.

    Attributes:
        placed: From the programme's frame into the world.
        carried: How often each was carried off within a part.
    """

    def __init__(self, n: int, config: PerformanceConfig) -> None:
        self._config = config
        self.placed, self.carried = FloorMove.none(n), np.zeros(n, int)

    def follow(self, sim: Simulation, now: ClipStep, everyone: bool) -> None:
        """Place the programme under the robots, all of them or those that were carried off."""
        there = self.placed.qpos(now.qpos)
        apart = np.linalg.norm(sim.qpos[:, :2] - there[:, :2], axis=-1)
        turned = np.abs(wrapped(heading(sim.qpos[:, 3:7]) - heading(there[:, 3:7])))
        off = (apart > self._config.carried_m) | (turned > self._config.turned_rad)
        which = off | everyone
        if not which.any():
            return
        if not everyone:
            self.carried += off
        new, old = FloorMove.onto(now.qpos, sim.qpos), self.placed
        self.placed = FloorMove(
            np.where(which, new.turn, old.turn), np.where(which[:, None], new.shift, old.shift)
        )


def _window(
    at: Callable[[np.ndarray], ClipStep], t: int, n: int, ahead: Sequence[int]
) -> tuple[ClipStep, ...]:
    return tuple(at(np.full(n, t + k)) for k in ahead)
