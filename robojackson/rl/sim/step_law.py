"""What a law of control needs to be along a clip. World frame, metres, radians."""

from typing import Protocol

import numpy as np
from jaxtyping import Float, Int


class StepLaw(Protocol):
    """Offsets of the targets of N robots at one step of their references."""

    def targets(
        self, qpos: Float[np.ndarray, "N nq"], qvel: Float[np.ndarray, "N nv"]
    ) -> Float[np.ndarray, "N nu"]:
        """Return the offsets of the motors' targets, rad."""


class StepCorrection(Protocol):
    """Offsets of the targets on the way to one step."""

    def __call__(
        self,
        qpos: Float[np.ndarray, "N nq"],
        qvel: Float[np.ndarray, "N nv"],
        beside_feet: bool = False,
    ) -> Float[np.ndarray, "N nu"]:
        """Return `StepLaw.targets` of `Law.at`."""

    def path(self) -> tuple[Float[np.ndarray, "N nq"], Float[np.ndarray, "N nv"]]:
        """Return `Law.path`."""


class Law(Protocol):
    """A feedback along the joined motions of a clip (`feedback.Feedback`)."""

    def at(
        self,
        row: Int[np.ndarray, " N"],
        shift: Float[np.ndarray, "N 3"],
        beside_feet: bool = False,
    ) -> StepLaw:
        """Return the feedback at rows whose cycles have moved them by `shift`, m.

        Args:
            beside_feet: Whether to follow the motion from where the feet of each robot stand.
        """

    def path(
        self, row: Int[np.ndarray, " N"], shift: Float[np.ndarray, "N 3"]
    ) -> tuple[Float[np.ndarray, "N nq"], Float[np.ndarray, "N nv"]]:
        """Return the states that the feedback keeps robots in, at rows whose cycles have moved them
        by `shift`, m."""

    @property
    def outline(self) -> Float[np.ndarray, "M J"]:
        """Hinge angles of the path that it keeps a robot on, at a few moments, rad."""
