"""The environment: N robots that follow one reference motion, as array code, in either mode.

A `Mode` defines the differences (`track_mode`, `paper_mode`): the effect of an action, the
observation, the reward, the start of an episode. Episodes end by a fall, by leaving the track, at
the end of a clip that is not cyclic, or by the time limit; only the last is a truncation and is
bootstrapped.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

import mujoco
import numpy as np
from jaxtyping import Float, Int

from robojackson.errors import BadConfiguration, UnknownName
from robojackson.motion.reference_motion import ReferenceMotion, motions_of
from robojackson.rl.config.train_config import PaperConfig, TrackConfig
from robojackson.rl.env.episode_totals import EpisodeTotals
from robojackson.rl.modes.mode import Mode, Score
from robojackson.rl.modes.paper_mode import PaperMode
from robojackson.rl.modes.rewards import RewardFunction
from robojackson.rl.modes.track_mode import TrackMode
from robojackson.rl.sim.simulation import require_same_clock
from robojackson.robot.model import Robot

PHYSICS = int(mujoco.mjtState.mjSTATE_INTEGRATION)


@dataclass
class StepResult:
    """Result of one step of all robots; arrays have N rows.

    Attributes:
        observation: Observations after resets.
        final_observation: Observations before resets (differ where done).
        reward, terms: Reward and its parts.
        terminated: Episodes that end by failure or with the clip.
        truncated: Episodes that end by the time limit.
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
    """N robots that follow one reference motion or several.

    Attributes:
        episode: Number of finished episodes; the paper's curriculum depends on it.
        step_index: Step of the reference that each robot is at.
    """

    def __init__(
        self,
        robot: Robot,
        reference: ReferenceMotion | Sequence[ReferenceMotion],
        config: TrackConfig | PaperConfig,
        n: int,
        seed: int,
        rewards: Mapping[str, RewardFunction] = MappingProxyType({}),
    ) -> None:
        motions = motions_of(reference)
        for motion in motions:
            _require_keypoints(motion, robot)
        self.config, self.n = config, n
        self.mode = mode_of(robot, motions, config, n, seed, rewards)
        self.sim, self.clip, self.limit = self.mode.sim, self.mode.clip, self.mode.limit
        for motion in motions:
            require_same_clock(self.sim.dt, motion.dt)
        self.rng = np.random.default_rng(seed)
        self.episode = 0
        self.step_index = np.zeros(n, int)
        self._start, self._age = np.zeros(n, int), np.zeros(n, int)
        self._last = np.zeros((n, robot.model.nu))
        self._totals = EpisodeTotals(n, self.clip.dt)
        self.observation_size = self.mode.observation_size
        self.actor_size = self.mode.actor_size
        self.action_size = robot.model.nu

    def reseed(self, seed: int) -> None:
        """Restart the random numbers and reset the learnt starts, which determines the next `reset`
        and everything after it."""
        self.rng, self.episode = np.random.default_rng(seed), 0
        self.sim.disturbances.restart(seed)
        self.mode.forget()

    def reset(self) -> Float[np.ndarray, "N D"]:
        """Start N new episodes; unfinished ones leave no row."""
        self._totals.clear(np.arange(self.n))
        self._begin(np.arange(self.n))
        return self._observe()

    def step(self, action: Float[np.ndarray, "N nu"]) -> StepResult:
        """Apply one action of all robots; finished episodes are followed by new ones."""
        action = np.clip(np.asarray(action, float), -1, 1)
        before = self.sim.points.copy()
        self._act(action)
        change = np.mean((action - self._last) ** 2, -1)
        self._last = action
        score = self.mode.score(self.clip.at(self.step_index), before, change, self.episode)
        reward = np.sum(list(score.terms.values()), 0)
        over = score.failed | self.clip.ended(self.step_index)
        late = (self._age >= self.limit) & ~over
        self._totals.add(reward, score.terms, {"site_error_m": score.site_error, **score.errors})
        result = StepResult(*(2 * (self._observe(),)), reward, score.terms, over, late)
        if (over | late).any():
            result.episodes = self._end(score, over | late, late)
            result.observation = self._observe()
        return result

    def state(self) -> dict[str, Any]:
        """Return everything that the next step depends on, as arrays."""
        size = mujoco.mj_stateSize(self.sim.model, PHYSICS)
        physics = np.zeros((self.n, size))
        for row, data in zip(physics, self.sim.datas, strict=True):
            mujoco.mj_getState(self.sim.model, data, row, PHYSICS)
        own = {
            name: getattr(self, name).copy() for name in ("step_index", "_start", "_age", "_last")
        }
        seen = {f"sim_{name}": getattr(self.sim, name).copy() for name in OBSERVED}
        estimate = self.sim.root_estimate
        felt = {} if estimate is None else estimate.state()
        counted = {"episode": np.array(self.episode), "physics": physics}
        return {**own, **seen, **felt, **counted, **self._totals.state(), **self.mode.state()}

    def restore(self, state: dict[str, Any]) -> None:
        """Restore the environment from `state`."""
        for row, data in zip(state["physics"], self.sim.datas, strict=True):
            mujoco.mj_setState(self.sim.model, data, row, PHYSICS)
        for name in ("step_index", "_start", "_age", "_last"):
            setattr(self, name, np.array(state[name]))
        for name in OBSERVED:
            getattr(self.sim, name)[:] = state[f"sim_{name}"]
        if self.sim.root_estimate is not None:
            self.sim.root_estimate.restore(state)
        self.episode = int(state["episode"])
        self._totals.restore(state)
        self.mode.restore(state)

    def close(self) -> None:
        """Stop the threads of the simulation."""
        self.sim.close()

    def _act(self, action: np.ndarray) -> None:
        for _ in range(self.mode.repeats):
            command = self.mode.command(self.clip.at(self.step_index + 1), action)
            self.sim.step(command)
            self.step_index += 1
            self._age += 1
            self.mode.after(command)

    def _end(self, score: Score, done: np.ndarray, late: np.ndarray) -> list[dict[str, float]]:
        """Return rows of the finished episodes and start new ones."""
        which = np.flatnonzero(done)
        columns = self.mode.ended(self._start[which], score.failed[which], self._age[which])
        reached = np.flatnonzero(late)
        self.mode.record_finished(reached, self.step_index[reached])
        rows = self._totals.close(which, self._age, self.mode.repeats)
        self.episode += len(which)
        self._begin(which)
        return [row | columns for row in rows]

    def _observe(self) -> np.ndarray:
        return self.mode.observe(self.clip.at(self.step_index + 1), self._last)

    def _begin(self, indices: Int[np.ndarray, " I"]) -> None:
        begun = self.mode.begin(len(indices), self.rng)
        self.sim.place(indices, begun.qpos, begun.qvel)
        self.step_index[indices] = self._start[indices] = begun.step
        self._age[indices] = 0
        self._last[indices] = 0.0


OBSERVED = ("qpos", "qvel", "points", "com", "broken", "previous", "count", "push_at")
"""Arrays of a simulation's copies."""


def _require_keypoints(reference: ReferenceMotion, robot: Robot) -> None:
    """Raise for a motion whose keypoints differ from the robot's.

    Raises:
        UnknownName: the message has those that differ.
    """
    names = robot.keypoint_names
    if names != reference.keypoint_names:
        unknown = sorted(set(reference.keypoint_names) ^ set(names))
        raise UnknownName("keypoint", ", ".join(unknown), "reference motion", names)


def mode_of(
    robot: Robot,
    motions: Sequence[ReferenceMotion],
    config: TrackConfig | PaperConfig,
    n: int,
    seed: int,
    rewards: Mapping[str, RewardFunction] = MappingProxyType({}),
) -> Mode:
    """Return the mode of a configuration.

    Raises:
        BadConfiguration: a user's reward terms for the paper's mode, whose reward is the paper's,
            or several motions, of which it follows one.
    """
    if not isinstance(config, PaperConfig):
        return TrackMode(robot, motions, config, n, seed, rewards)
    if rewards:
        raise BadConfiguration("reward terms of your own need mode=track; paper has the paper's")
    if len(motions) > 1:
        raise BadConfiguration("several motions need mode=track; paper follows one")
    return PaperMode(robot, motions[0], config, n, seed)
