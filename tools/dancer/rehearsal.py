"""Rehearsals: robots that follow many motions, driven by a dancer, corrected by its experts.

DAgger (Ross, Gordon and Bagnell, AISTATS 2011): the dancer visits the states, the experts say what
they would do there. An expert's advice is an action: the offset of the motors' targets from the
reference's, in full actions of the dancer, -1..1.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields

import numpy as np
from jaxtyping import Bool, Float

from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.rl.config.train_config import ControlConfig, RandomConfig, ResetConfig
from robojackson.rl.modes.observation import Observer
from robojackson.rl.modes.reset_states import (
    StartPhases,
    default_standing_pose,
    noisy,
    standing_pose_at,
)
from robojackson.rl.sim.feedback_law import Feedback
from robojackson.rl.sim.feedforward import lead_of
from robojackson.rl.sim.motors import residual_scale
from robojackson.rl.sim.nominal_path import Gains
from robojackson.rl.sim.path_trial import LARGEST_MOVE
from robojackson.rl.sim.preview import preview_of
from robojackson.rl.sim.reference_clip import Clip
from robojackson.rl.sim.simulation import Simulation
from robojackson.rl.sim.standing_feet import Feet
from robojackson.robot.fall import Fall
from robojackson.robot.model import Robot

ACTION_FACTOR = 4.0
"""Full action of the dancer in full actions of the robot: experts move targets by up to six."""
LOST_TILT, LOST_HEIGHT_M = 0.6, 0.2
"""Distance of the up axis and of the root's height from the reference at which an episode ends."""
FORGOTTEN_S = 0.3
"""Time before an episode's failure whose advice is not used."""
EPISODE_S = 8.0
NOISE = 0.04
"""Standard deviation of the noise on actions, full actions."""
RESET = ResetConfig(stand_share=0.05)
WORLD = RandomConfig(friction=0.3, gains=0.1, pushes=0.4)
CONTROL = ControlConfig(feedforward=1.0, feedback=0.0, action_factor=ACTION_FACTOR)
Actor = Callable[[Float[np.ndarray, "N D"]], Float[np.ndarray, "N nu"]]


@dataclass(frozen=True)
class Lessons:
    """Observations with the advice of the experts, float16, and how long episodes lasted.

    Attributes:
        survived: Share of the started episodes of the dancer alone that did not fail.
    """

    seen: Float[np.ndarray, "L D"]
    advice: Float[np.ndarray, "L nu"]
    survived: float


class Rehearsal:
    """Robots side by side, each on its way through one of the motions.

    Args:
        experts: Feedback of every motion.
        n: Number of robots.
    """

    def __init__(
        self,
        robot: Robot,
        motions: Sequence[ReferenceMotion],
        experts: Sequence[Gains],
        n: int,
        seed: int,
    ) -> None:
        leads = [lead_of(robot, motion, CONTROL) for motion in motions]
        joined = Gains(*(np.concatenate([getattr(one, part.name) for one in experts])
                         for part in fields(Gains)))  # fmt: skip
        limit = LARGEST_MOVE * residual_scale(robot, ControlConfig())
        ahead = np.concatenate([preview_of(motion, robot) for motion in motions])
        lead = np.concatenate([one for one in leads if one is not None])
        self._clip = Clip(motions, lead, ahead, Feedback(joined, limit, Feet(robot)))
        self._sim = Simulation(robot, CONTROL, n, 1, WORLD, seed)
        self._observer = Observer(robot, "preview")
        self._fall = Fall.of(robot, LOST_HEIGHT_M, LOST_TILT)
        self._starts = StartPhases(self._clip, RESET.failure_share)
        self._stand = default_standing_pose(robot)
        self._rng = np.random.default_rng(seed)
        self._limit = round(EPISODE_S / self._clip.dt)
        self._n, self._share = n, 1.0
        self._step, self._start, self._age = (np.zeros(n, int) for _ in range(3))
        self._alone, self._last = np.zeros(n, bool), np.zeros((n, robot.model.nu))
        self._begin(np.arange(n))

    @property
    def full_action(self) -> Float[np.ndarray, " nu"]:
        """Return the radians that a full action of the dancer moves each target."""
        return np.asarray(self._sim.residual)

    @property
    def size(self) -> tuple[int, int]:
        """Return the lengths of an observation and of an action."""
        return self._observer.actor_size, self._last.shape[1]

    def run(self, actor: Actor, share: float, steps: int) -> Lessons:
        """Rehearse.

        Args:
            actor: The dancer.
            share: Share of the episodes that the dancer drives; experts drive the others.
            steps: Control steps of every robot.
        """
        size, motors = self.size
        self._share = share
        seen = np.zeros((steps, self._n, size), np.float16)
        advice = np.zeros((steps, self._n, motors), np.float16)
        good = np.ones((steps, self._n), bool)
        ends: list[tuple[int, int]] = []
        for k in range(steps):
            seen[k], advice[k] = self._advance(actor)
            failed = self._failed()
            for i in np.flatnonzero(failed):
                good[max(0, k - round(FORGOTTEN_S / self._clip.dt)) : k + 1, i] = False
            done = failed | self._clip.ended(self._step) | (self._age >= self._limit)
            alone = done & self._alone
            ends.append((int((alone & ~failed).sum()), int(alone.sum())))
            rows = np.flatnonzero(done)
            self._starts.record(self._start[rows], failed[rows])
            self._begin(rows)
        held, all_ends = np.sum(ends, 0)
        return Lessons(seen[good], advice[good], held / max(1, all_ends))

    def _advance(self, actor: Actor) -> tuple[np.ndarray, np.ndarray]:
        sim, following = self._sim, self._clip.at(self._step + 1)
        observed = self._observer.observe(*sim.sensed(), sim.points, following, self._last)
        observed = observed[:, : self._observer.actor_size]
        assert following.feedback is not None
        moved = following.feedback(sim.qpos, sim.qvel)
        advice = np.clip(moved / sim.residual, -1, 1)
        noise = NOISE * self._rng.normal(size=advice.shape)
        own = actor(observed) if self._alone.any() else advice
        action = np.clip(np.where(self._alone[:, None], own, advice) + noise, -1, 1)
        sim.step(sim.reference_angles(following) + sim.residual * action)
        self._last, self._step, self._age = action, self._step + 1, self._age + 1
        return observed, advice

    def _failed(self) -> Bool[np.ndarray, " N"]:
        there = self._clip.at(self._step).qpos
        return self._fall.has_fallen(self._sim.qpos, there) | self._sim.broken

    def _begin(self, rows: np.ndarray) -> None:
        """Begin new episodes: somewhere in a motion, or in the stand."""
        if not len(rows):
            return
        rng, start = self._rng, self._starts.draw(len(rows), self._rng)
        at = self._clip.at(start)
        qpos, qvel = noisy(at.qpos, at.qvel, RESET, rng)
        for row in np.flatnonzero(rng.random(len(rows)) < RESET.stand_share):
            qpos[row], qvel[row] = standing_pose_at(self._stand, at.qpos[row, :7]), 0.0
        self._sim.place(rows, qpos, qvel)
        for array, value in ((self._step, start), (self._start, start), (self._age, 0)):
            array[rows] = value
        self._alone[rows] = rng.random(len(rows)) < self._share
        self._last[rows] = 0.0
