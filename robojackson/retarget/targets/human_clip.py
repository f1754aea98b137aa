"""A human motion at the steps of the solver, on the robot's clock. Metres, seconds, world frame."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.interpolate import CubicSpline


@dataclass(frozen=True)
class HumanClip:
    """Human keypoints at the steps of the solver.

    Attributes:
        time_s: Time in the source clip, seconds.
        keypoints_w: HybrIK's 29 keypoints, metres.
        contact: States of `CONTACT_POINTS`.
        valid: False where the person was not detected.
        dt: Seconds a step on the robot's clock.
        cycle_offset: Displacement of one cycle, metres; None when the clip does not repeat.
    """

    time_s: Float[np.ndarray, " N"]
    keypoints_w: Float[np.ndarray, "N 29 3"]
    contact: Int[np.ndarray, "N 4"]
    valid: Bool[np.ndarray, " N"]
    dt: float
    cycle_offset: Float[np.ndarray, "3"] | None

    @property
    def edges(self) -> str:
        """How scipy's filters treat the ends: a cycle wraps around."""
        return "nearest" if self.cycle_offset is None else "wrap"


def at_steps(
    keypoints: Float[np.ndarray, "T 29 3"], fps: float, time_s: Float[np.ndarray, " N"]
) -> Float[np.ndarray, "N 29 3"]:
    """Return the keypoints at any times inside the clip by cubic spline."""
    return np.asarray(CubicSpline(np.arange(len(keypoints)) / fps, keypoints)(time_s))


def labels_at(values: np.ndarray, fps: float, time_s: Float[np.ndarray, " N"]) -> np.ndarray:
    """Return the values of the nearest frame."""
    return np.asarray(values[np.clip(np.round(time_s * fps).astype(int), 0, len(values) - 1)])
