"""How gains along a motion move the targets of motors. World frame, metres, radians."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float, Int

from robojackson.rl.feedback.nominal_path import Gains
from robojackson.rl.feedback.standing_feet import Feet
from robojackson.rl.sim.tangent import state_difference

MOMENTS = 8
"""Moments of a path by which it is known again."""


@dataclass(frozen=True)
class StepFeedback:
    """The feedback of N robots at one step of their references."""

    gain: Float[np.ndarray, "N nu X"]
    offset: Float[np.ndarray, "N nu"]
    qpos: Float[np.ndarray, "N nq"]
    qvel: Float[np.ndarray, "N nv"]
    limit: Float[np.ndarray, " nu"]
    feet: Feet
    places: Float[np.ndarray, "N F 3"]

    def targets(
        self, qpos: Float[np.ndarray, "N nq"], qvel: Float[np.ndarray, "N nv"]
    ) -> Float[np.ndarray, "N nu"]:
        """Return the offsets of the motors' targets, rad."""
        apart = state_difference(qpos, qvel, self.qpos, self.qvel)
        moved = np.isfinite(self.places[:, 0, 0])
        if moved.any():
            apart[moved, :2] -= self.feet.apart(qpos[moved], self.places[moved])
        turned = (self.gain @ apart[:, :, None])[:, :, 0] + self.offset
        result: np.ndarray = -np.clip(turned, -self.limit, self.limit)
        return result


@dataclass(frozen=True)
class Feedback:
    """The feedback along one motion or several, their steps one after the other.

    Attributes:
        gains: Gains and nominal states, scaled by the share of the control law.
        limit: Largest offset of each target, rad.
        feet: The robot's feet.
    """

    gains: Gains
    limit: Float[np.ndarray, " nu"]
    feet: Feet

    @property
    def held(self) -> float:
        """Share of the starts from which it keeps robots upright by itself, 0..1, of the motion
        that falls most; NaN where that was not tried."""
        return float(np.min(self.gains.held))

    @property
    def outline(self) -> Float[np.ndarray, "M J"]:
        """Hinge angles of the path that it keeps a robot on, at `MOMENTS` moments, rad."""
        path = self.gains.qpos
        return np.asarray(path[np.linspace(0, len(path) - 1, MOMENTS).astype(int), 7:])

    @cached_property
    def footholds(self) -> Float[np.ndarray, "S F 3"]:
        """Places of the feet at every step, also of motions that are followed where they are."""
        return self.feet.places(self.gains.qpos)

    def path(
        self, row: Int[np.ndarray, " N"], shift: Float[np.ndarray, "N 3"]
    ) -> tuple[Float[np.ndarray, "N nq"], Float[np.ndarray, "N nv"]]:
        """Return the nominal states at rows of the joined motions, moved by `shift`, m."""
        qpos = self.gains.qpos[row]
        qpos[:, :3] += shift
        return qpos, self.gains.qvel[row]

    def at(
        self,
        row: Int[np.ndarray, " N"],
        shift: Float[np.ndarray, "N 3"],
        beside_feet: bool = False,
    ) -> StepFeedback:
        """Return the feedback at rows of the joined motions, whose cycles have moved them by
        `shift`, m.

        Args:
            beside_feet: Whether to follow the motion from where the feet of each robot stand, as a
                sampled path is always followed.
        """
        gains = self.gains
        found = (gains.gain[row], gains.offset[row], *self.path(row, shift))
        places = (self.footholds if beside_feet else gains.places)[row] + shift[:, None]
        return StepFeedback(*found, self.limit, self.feet, places)
