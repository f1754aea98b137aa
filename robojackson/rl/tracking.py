"""The tracking environment: N robots that follow one reference motion, as array code.

Action: residual joint angles in actuator order, -1..1, times `Simulation.residual` radians,
added to the reference's next hinge angles and followed by the PD law of `Simulation`. Observation:
`observation.observe`. Reward: the sum of `rewards.reward_terms`. Episodes start as `starts` says
and end by a fall, by getting lost, at the end of a clip that is not cyclic, or by the time limit;
only the last is a truncation and is bootstrapped.
"""

from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float, Int

from robojackson.errors import UnknownName
from robojackson.motion.reference import ReferenceMotion
from robojackson.retarget.robot import Robot
from robojackson.rl.clip import Clip
from robojackson.rl.config import TrackConfig
from robojackson.rl.episodes import EpisodeTotals
from robojackson.rl.observation import observation_size, observe
from robojackson.rl.physics import Simulation, require_same_clock
from robojackson.rl.rewards import (
    TrackedPoints,
    fallen,
    lost,
    reward_terms,
    tracking_errors,
)
from robojackson.rl.starts import SettledStates, StartPhases, default_stand, noisy, stand_at

SETTLED_STATES_NEEDED = 32
PELVIS = "pelvis"
FEET = ("left_foot", "right_foot")
EXTREMITIES = ("left_hand", "right_hand", "head")


@dataclass
class StepResult:
    """What one step of all robots brought; arrays have N rows.

    Attributes:
        observation: After resets.
        final_observation: Before resets (differs where done).
        reward, terms: Their sum and its parts.
        terminated: Ends by failure or with the clip.
        truncated: Ends by the time limit.
        episodes: One summary row for each episode that ended.
    """

    observation: Float[np.ndarray, "N D"]
    final_observation: Float[np.ndarray, "N D"]
    reward: Float[np.ndarray, " N"]
    terms: dict[str, Float[np.ndarray, " N"]]
    terminated: np.ndarray
    truncated: np.ndarray
    episodes: list[dict[str, float]] = field(default_factory=list)


class TrackingCore:
    """N robots that follow one reference motion."""

    def __init__(
        self, robot: Robot, reference: ReferenceMotion, config: TrackConfig, n: int, seed: int
    ) -> None:
        self.config, self.n, self.clip = config, n, Clip(reference)
        names = robot.keypoint_names
        if names != reference.keypoint_names:
            unknown = sorted(set(reference.keypoint_names) ^ set(names))
            raise UnknownName("keypoint", ", ".join(unknown), "reference motion", names)
        self._which = TrackedPoints(
            pelvis=names.index(PELVIS),
            hands=tuple(names.index(name) for name in EXTREMITIES),
            limbs=tuple(names.index(name) for name in (*FEET, *EXTREMITIES)),
        )
        self.sim = Simulation(robot, config.control, n, config.threads)
        require_same_clock(self.sim.dt, reference.dt)
        self.starts = StartPhases(self.clip, config.reset.failure_share)
        self._settled = SettledStates(robot.model.nq, robot.model.nv)
        self._stand = default_stand(robot.model)
        self.rng = np.random.default_rng(seed)
        self.limit = round(config.episode_seconds / self.clip.dt)
        self.step_index = np.zeros(n, int)
        self._start, self._age = np.zeros(n, int), np.zeros(n, int)
        self._last = np.zeros((n, robot.model.nu))
        self._totals = EpisodeTotals(n, self.clip.dt)
        self.observation_size = observation_size(robot.model.nq - 7, robot.model.nu, len(names))
        self.action_size = robot.model.nu

    def reseed(self, seed: int) -> None:
        """Restart the random numbers and forget what was learnt of starts: the next `reset` and all
        that follows are then determined."""
        self.rng = np.random.default_rng(seed)
        self.starts.forget()
        self._settled.forget()

    def reset(self) -> Float[np.ndarray, "N D"]:
        """Begin N new episodes; those that were under way leave no row."""
        self._totals.clear(np.arange(self.n))
        self._begin(np.arange(self.n))
        return self._observe()

    def step(self, action: Float[np.ndarray, "N nu"]) -> StepResult:
        """One control step of all robots; those whose episode ended begin a new one."""
        action = np.clip(np.asarray(action, float), -1, 1)
        following = self.clip.at(self.step_index + 1)
        hinge = self.sim.motors.hinge
        before = self.sim.points.copy()
        self.sim.step(following.qpos[:, 7:][:, hinge] + self.sim.residual * action)
        self.step_index += 1
        self._age += 1
        sim, moved = self.sim, (self.sim.points - before) / self.clip.dt
        errors = tracking_errors(sim.qpos, sim.qvel, sim.points, moved, following, self._which)
        change = np.mean((action - self._last) ** 2, -1)
        self._last = action
        terms = reward_terms(errors, change, self.config.reward)
        reward = np.sum(list(terms.values()), 0)
        rules = self.config.termination
        failed = fallen(sim.qpos, rules) | lost(errors, rules) | sim.broken
        over = failed | self.clip.ended(self.step_index)
        late = (self._age >= self.limit) & ~over
        result = StepResult(*(2 * (self._observe(),)), reward, terms, over, late)
        self._totals.add(reward, terms, errors.site_mean)
        done = np.flatnonzero(over | late)
        if len(done):
            self.starts.record(self._start[done], failed[done])
            self._remember(np.flatnonzero(late))
            result.episodes = self._totals.close(done, self._age)
            self._begin(done)
            result.observation = self._observe()
        return result

    def close(self) -> None:
        """Stop the threads of the simulation."""
        self.sim.close()

    def _observe(self) -> np.ndarray:
        target = self.clip.at(self.step_index + 1)
        return observe(self.sim.qpos, self.sim.qvel, self.sim.points, target, self._last)

    def _begin(self, indices: Int[np.ndarray, " I"]) -> None:
        reset, rng = self.config.reset, self.rng
        phase = self.starts.draw(len(indices), rng)
        at = self.clip.at(phase)
        qpos, qvel = noisy(at.qpos, at.qvel, reset, rng)
        kind = rng.random(len(indices))
        for row in np.flatnonzero(kind < reset.stand_share):
            qpos[row], qvel[row] = stand_at(self._stand, at.qpos[row, :7]), 0.0
        if len(self._settled) >= SETTLED_STATES_NEEDED:
            chosen = (kind >= reset.stand_share) & (kind < reset.stand_share + reset.settled_share)
            for row in np.flatnonzero(chosen):
                qpos[row], qvel[row], phase[row] = self._settled.draw(rng)
                qpos[row, :2] += self.clip.at(phase[row : row + 1]).qpos[0, :2]
        self.sim.place(indices, qpos, qvel)
        self.step_index[indices] = self._start[indices] = phase
        self._age[indices] = 0
        self._last[indices] = 0.0

    def _remember(self, indices: Int[np.ndarray, " I"]) -> None:
        """Keep the last states of episodes that reached the time limit of a cyclic clip."""
        if not self.clip.cyclic:
            return
        for i in indices:
            qpos = self.sim.qpos[i].copy()
            qpos[:2] -= self.clip.at(self.step_index[i : i + 1]).qpos[0, :2]
            self._settled.add(qpos, self.sim.qvel[i], int(self.step_index[i] % self.clip.steps))
