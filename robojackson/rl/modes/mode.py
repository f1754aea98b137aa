"""Interface of the two ways to learn a motion, `track` and `paper`.

The environment is one class, `tracking_core.TrackingCore`; a mode defines the command of an action,
the observation, the reward of a step and the start of an episode.
"""

from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from jaxtyping import Float, Int

from robojackson.rl.sim.reference_clip import Clip, ClipStep
from robojackson.rl.sim.simulation import Simulation


@dataclass(frozen=True)
class Score:
    """Score of one step; arrays have N rows.

    Attributes:
        terms: Parts of the reward.
        failed: Episodes that end by a fall or by leaving the track.
        site_error: Mean distance of the sites relative to the pelvis, m.
        errors: Further errors for the table of episodes, by name.
    """

    terms: dict[str, Float[np.ndarray, " N"]]
    failed: np.ndarray
    site_error: Float[np.ndarray, " N"]
    errors: dict[str, Float[np.ndarray, " N"]] = field(default_factory=dict)


@dataclass(frozen=True)
class EpisodeStart:
    """States in which episodes start, and the clip step of each."""

    step: Int[np.ndarray, " I"]
    qpos: Float[np.ndarray, "I nq"]
    qvel: Float[np.ndarray, "I nv"]


class Mode(Protocol):
    """One way of learning a motion.

    Attributes:
        sim: The simulation, under the control law of the mode.
        clip: The motion that the mode compares with.
        repeats: Control steps an action.
        limit: Control steps of an episode.
        observation_size: Length of an observation.
        actor_size: Length of the policy's part of it, at its beginning.
    """

    sim: Simulation
    clip: Clip
    repeats: int
    limit: int
    observation_size: int
    actor_size: int

    def command(self, following: ClipStep, action: np.ndarray) -> np.ndarray:
        """Return the simulation's command for actions -1..1 and the reference's next step."""

    def observe(self, following: ClipStep, action: np.ndarray) -> Float[np.ndarray, "N D"]:
        """Return the observations, with the next step of the reference and the last action."""

    def of_files(self, weight: Float[np.ndarray, "D units"]) -> Float[np.ndarray, "E units"]:
        """Return the first weights of a network for the observation that its file is for."""

    def after(self, command: np.ndarray) -> None:
        """Count a control step of the simulation; called after each."""

    def score(self, at: ClipStep, before: np.ndarray, change: np.ndarray, episode: int) -> Score:
        """Return the score of the last action.

        Args:
            at: The reference now.
            before: The sites one action ago, world, m.
            change: Mean squared change of the action.
            episode: Number of finished episodes.
        """

    def begin(self, count: int, rng: np.random.Generator) -> EpisodeStart:
        """Return states for new episodes."""

    def ended(
        self, start: Int[np.ndarray, " I"], failed: np.ndarray, age: Int[np.ndarray, " I"]
    ) -> dict[str, float]:
        """Learn from finished episodes; return columns for their rows."""

    def record_finished(self, indices: Int[np.ndarray, " I"], step: Int[np.ndarray, " I"]) -> None:
        """Learn from the states of episodes that reached the time limit."""

    def forget(self) -> None:
        """Reset everything learnt from episodes."""

    def state(self) -> dict[str, Any]:
        """Return the arrays that a resumed run needs."""

    def restore(self, state: dict[str, Any]) -> None:
        """Restore the mode from `state`."""
