"""The tracking mode: residuals on PD targets, local tracking reward, starts all over the clip.

Action: residual joint angles in actuator order, -1..1, times `Simulation.residual` radians, added
to the reference's next hinge angles and followed by the PD law of `Simulation`. Observation:
`observation.Observer`. Reward: `rewards.reward_terms`. Starts of episodes: `reset_states`.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.rl.config.paper_config import BETA
from robojackson.rl.config.train_config import ControlConfig, RewardConfig, TrackConfig, TrainConfig
from robojackson.rl.feedback.driven_clip import driven_clip
from robojackson.rl.modes.differences import Differences
from robojackson.rl.modes.mode import EpisodeStart, Score
from robojackson.rl.modes.observation import AHEAD, Observer
from robojackson.rl.modes.reset_states import (
    SettledStates,
    StartPhases,
    default_standing_pose,
    noisy,
    standing_pose_at,
)
from robojackson.rl.modes.rewards import (
    RewardFunction,
    RewardState,
    TrackedPoints,
    TrackingErrors,
    is_off_track,
    own_terms,
    require_names_of_their_own,
    reward_terms,
    tracked_points,
    tracking_errors,
)
from robojackson.rl.sim.motors import feedback_share
from robojackson.rl.sim.reference_clip import ClipStep
from robojackson.rl.sim.simulation import Simulation
from robojackson.robot.description import RobotDescription
from robojackson.robot.fall import Fall
from robojackson.robot.model import Robot
from robojackson.robot.tree_kinematics import tree

SETTLED_STATES_NEEDED = 32
PERFECT_OF_THE_PAPER = 5.0
"""Reward of a perfect step by the paper; ours is `RewardConfig.perfect`."""


class TrackMode:
    """Tracking of one reference motion or several by N robots (`Mode` protocol)."""

    repeats = 1

    def __init__(
        self,
        robot: Robot,
        reference: ReferenceMotion | Sequence[ReferenceMotion],
        config: TrackConfig,
        n: int,
        seed: int,
        rewards: Mapping[str, RewardFunction] = MappingProxyType({}),
    ) -> None:
        require_names_of_their_own(rewards)
        self._config, self._rewards = config, rewards
        ahead, control = config.observation in AHEAD, control_of(config)
        self.clip = driven_clip(robot, reference, control, ahead)
        names = robot.keypoint_names
        self._which = tracked_points(names, tree(robot) if config.reward.bodies else None)
        self.sim = Simulation(robot, control, n, config.threads, config.random, seed)
        self.starts = StartPhases(self.clip, config.reset.failure_share)
        self._settled = SettledStates(robot.model.nq, robot.model.nv)
        self._stand = default_standing_pose(robot)
        rules = config.termination
        self._fall = Fall.of(robot, rules.fall_height, rules.fall_tilt)
        self.limit = round(config.episode_seconds / self.clip.dt)
        self._observer = Observer(robot, config.observation)
        self.observation_size = self._observer.size
        self.actor_size = self._observer.actor_size
        self._differences = None
        if config.differences:
            rest = self.observation_size - self.actor_size
            self._differences = Differences(robot.model.nq - 7, robot.model.nu, rest)
            self.observation_size = self._differences.whole
            self.actor_size = self._differences.size

    def command(self, following: ClipStep, action: np.ndarray) -> np.ndarray:
        """Return the motors' targets of the actions."""
        result: np.ndarray = self.sim.reference_angles(following) + self.sim.residual * action
        return result

    def observe(self, following: ClipStep, action: np.ndarray) -> Float[np.ndarray, "N D"]:
        """Return the observations."""
        sim = self.sim
        exact = (sim.qpos, sim.qvel)
        seen = self._observer.observe(*sim.sensed(), sim.points, following, action, exact)
        return seen if self._differences is None else self._differences.of(seen)

    def of_files(self, weight: Float[np.ndarray, "D units"]) -> Float[np.ndarray, "E units"]:
        """Return the first weights of a network for an observation without differences."""
        return weight if self._differences is None else self._differences.taken_up(weight)

    def after(self, command: np.ndarray) -> None:
        """Do nothing: no quantity is counted within a step."""

    def score(self, at: ClipStep, before: np.ndarray, change: np.ndarray, episode: int) -> Score:
        """Return the score of the last action by the tracking reward."""
        sim, rules = self.sim, self._config.termination
        moved = (sim.points - before) / self.clip.dt
        errors, terms = evaluate_step(sim, moved, at, change, self._which, self._config.reward)
        if self._rewards:
            seen = RewardState(sim.qpos, sim.qvel, sim.points, moved, at, errors, change)
            terms |= own_terms(self._rewards, seen)
        fell = self._fall.has_fallen(sim.qpos, at.qpos)
        failed = fell | is_off_track(errors, rules) | sim.broken
        return Score(terms, failed, errors.site_mean)

    def begin(self, count: int, rng: np.random.Generator) -> EpisodeStart:
        """Return states for new episodes: a phase, a state reached before, or the stand."""
        reset = self._config.reset
        phase = self.starts.draw(count, rng)
        at = self.clip.at(phase)
        qpos, qvel = noisy(at.qpos, at.qvel, reset, rng)
        kind = rng.random(count)
        for row in np.flatnonzero(kind < reset.stand_share):
            qpos[row], qvel[row] = standing_pose_at(self._stand, at.qpos[row, :7]), 0.0
        if len(self._settled) >= SETTLED_STATES_NEEDED:
            chosen = (kind >= reset.stand_share) & (kind < reset.stand_share + reset.settled_share)
            for row in np.flatnonzero(chosen):
                qpos[row], qvel[row], phase[row] = self._settled.draw(rng)
                qpos[row, :2] += self.clip.at(phase[row : row + 1]).qpos[0, :2]
        return EpisodeStart(phase, qpos, qvel)

    def ended(
        self, start: Int[np.ndarray, " I"], failed: np.ndarray, age: Int[np.ndarray, " I"]
    ) -> dict[str, float]:
        """Learn from finished episodes; return columns for their rows."""
        self.starts.record(start, failed)
        return {}

    def record_finished(self, indices: Int[np.ndarray, " I"], step: Int[np.ndarray, " I"]) -> None:
        """Store the last states of episodes that reached the time limit of a cyclic motion."""
        for i, at in zip(indices, step, strict=True):
            now = np.array([at])
            if self.clip.repeats(now)[0]:
                qpos = self.sim.qpos[i].copy()
                qpos[:2] -= self.clip.at(now).qpos[0, :2]
                self._settled.add(qpos, self.sim.qvel[i], int(self.clip.folded(now)[0]))

    def forget(self) -> None:
        """Reset everything learnt from episodes."""
        self.starts.forget()
        self._settled.forget()

    def state(self) -> dict[str, Any]:
        """Return the arrays that a resumed run needs."""
        return {"failures": self.starts.failures, **self._settled.state()}

    def restore(self, state: dict[str, Any]) -> None:
        """Restore the mode from `state`."""
        self.starts.failures = np.array(state["failures"])
        self._settled.restore(state)


def control_of(config: TrackConfig) -> ControlConfig:
    """Return the control law of a training: with a robot's own measurements the feedback is from an
    estimate of the root, unless it is set otherwise; a policy of many motions has none."""
    control, seen = config.control, config.observation
    if seen in AHEAD and control.feedback is None:
        return replace(control, feedback=0.0)
    if seen in ("full", "full_preview") or control.feedback == 0:
        return control
    return replace(control, root_state=control.root_state or "estimated")


def is_fed(config: TrainConfig, description: RobotDescription) -> bool:
    """Return whether a training is on top of feedback along its motion."""
    control = control_of(config.track)
    pd = config.mode == "track" and control.law == "pd"
    return pd and feedback_share(description, control) > 0


def evaluate_step(
    sim: Simulation,
    moved: Float[np.ndarray, "N K 3"],
    at: ClipStep,
    change: Float[np.ndarray, " N"],
    which: TrackedPoints,
    reward: RewardConfig,
) -> tuple[TrackingErrors, dict[str, Float[np.ndarray, " N"]]]:
    """Return errors of every robot and the terms of its reward, including the bonus for curiosity.

    Args:
        moved: Velocity of the points, m/s.
        change: Mean squared change of the action.
    """
    errors = tracking_errors(sim.qpos, sim.qvel, sim.points, moved, at, which)
    terms = reward_terms(errors, change, reward)
    if reward.curiosity != "off":
        beta = BETA[reward.curiosity] * reward.perfect / PERFECT_OF_THE_PAPER
        terms["curiosity"] = beta * np.abs(sim.qvel[:, 6:]).sum(-1)
    return errors, terms
