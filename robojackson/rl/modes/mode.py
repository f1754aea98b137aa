"""What differs between the two ways of learning a motion, `track` and `paper`.

The environment is one class, `tracking_core.TrackingCore`; a mode tells it how an action becomes a
command, what the policy sees, what a step is worth and how an episode begins.
"""

from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from jaxtyping import Float, Int

from robojackson.rl.sim.reference_clip import Clip, ClipStep
from robojackson.rl.sim.simulation import Simulation


@dataclass(frozen=True)
class Score:
    """What one step was worth; arrays have N rows.

    Attributes:
        terms: Parts of the reward.
        failed: Ends by a fall or by getting lost.
        site_error: Mean distance of the sites relative to the pelvis, m.
        errors: Further errors for the table of episodes, by name.
    """

    terms: dict[str, Float[np.ndarray, " N"]]
    failed: np.ndarray
    site_error: Float[np.ndarray, " N"]
    errors: dict[str, Float[np.ndarray, " N"]] = field(default_factory=dict)


@dataclass(frozen=True)
class EpisodeStart:
    """States in which episodes begin, and the clip step that each belongs to."""

    step: Int[np.ndarray, " I"]
    qpos: Float[np.ndarray, "I nq"]
    qvel: Float[np.ndarray, "I nv"]


class Mode(Protocol):
    """One way of learning a motion.

    Attributes:
        sim: The simulation, under the control law of the mode.
        clip: The motion, as the mode compares with it.
        repeats: Control steps an action.
        limit: Control steps of an episode.
        observation_size: Length of an observation.
        actor_size: Length of what the policy sees of it: its beginning.
    """

    sim: Simulation
    clip: Clip
    repeats: int
    limit: int
    observation_size: int
    actor_size: int

    def command(self, following: ClipStep, action: np.ndarray) -> np.ndarray:
        """What the simulation is told, for actions -1..1 and the reference's next step."""

    def observe(self, following: ClipStep, action: np.ndarray) -> Float[np.ndarray, "N D"]:
        """What the policies see, with the next step of the reference and their last action."""

    def after(self, command: np.ndarray) -> None:
        """Called after every control step of the simulation."""

    def score(self, at: ClipStep, before: np.ndarray, change: np.ndarray, episode: int) -> Score:
        """What the last action was worth.

        Args:
            at: The reference now.
            before: The sites one action ago, world, m.
            change: Mean squared change of the action.
            episode: Number of episodes that ended before.
        """

    def begin(self, count: int, rng: np.random.Generator) -> EpisodeStart:
        """States for new episodes."""

    def ended(
        self, start: Int[np.ndarray, " I"], failed: np.ndarray, age: Int[np.ndarray, " I"]
    ) -> dict[str, float]:
        """Learn from episodes that ended; columns for their rows."""

    def record_finished(self, indices: Int[np.ndarray, " I"], step: Int[np.ndarray, " I"]) -> None:
        """Learn from the states of episodes that reached the time limit."""

    def forget(self) -> None:
        """Forget what was learnt from episodes."""

    def state(self) -> dict[str, Any]:
        """Arrays that a resumed run needs."""

    def restore(self, state: dict[str, Any]) -> None:
        """Go on from what `state` gave."""
