"""A reference motion as arrays that a thousand environments can read at their own step.

A cyclic clip goes on for ever: step s is step s mod S of cycle s // S, moved by that many cycle
offsets. A clip that is not cyclic holds its last step. Frames and units as in `ReferenceMotion`.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from robojackson.errors import RejectedReference, TrackTooShort
from robojackson.motion.reference_motion import ReferenceMotion

LEAST_STEPS = 8


@dataclass(frozen=True)
class ClipStep:
    """The reference at one step for each of N environments.

    Attributes:
        moved: Velocities of the points, m/s.
        phase: 0..1 of the clip.
        lead: Offset of the motors' targets from the reference's angles, rad; None without one.
    """

    step: Int[np.ndarray, " N"]
    qpos: Float[np.ndarray, "N nq"]
    qvel: Float[np.ndarray, "N nv"]
    points: Float[np.ndarray, "N K 3"]
    moved: Float[np.ndarray, "N K 3"]
    phase: Float[np.ndarray, " N"]
    lead: Float[np.ndarray, "N nu"] | None = None


class Clip:
    """Random access to a reference motion by step.

    Args:
        lead: Offset of the motors' targets from the reference's angles at every step, rad.

    Raises:
        TrackTooShort, RejectedReference: too few steps, or values that are no numbers.
    """

    def __init__(
        self, reference: ReferenceMotion, lead: Float[np.ndarray, "S nu"] | None = None
    ) -> None:
        if len(reference) < LEAST_STEPS:
            raise TrackTooShort(
                f"the reference motion has {len(reference)} steps, {LEAST_STEPS} are the least"
            )
        if not np.isfinite(reference.qpos).all() or not np.isfinite(reference.qvel).all():
            raise RejectedReference("the reference motion holds values that are no numbers")
        self.steps, self.cyclic, self.dt = len(reference), reference.cyclic, reference.dt
        self._qpos = np.asarray(reference.qpos, float)
        self._qvel = np.asarray(reference.qvel, float)
        self._points = np.asarray(reference.keypoints_w, float)
        self._offset = np.asarray(reference.cycle_offset, float)
        self._lead = lead
        self._moved = self._velocities()
        self._last: ClipStep | None = None

    def at(self, step: Int[np.ndarray, " N"]) -> ClipStep:
        """The reference at each environment's step; read-only: what is asked for twice in a row, as
        the end of one control step and the beginning of the next are, is computed once."""
        if self._last is None or not np.array_equal(self._last.step, step):
            self._last = self._read(np.array(step))
        return self._last

    def _read(self, step: Int[np.ndarray, " N"]) -> ClipStep:
        cycle, index = self._split(step)
        offset = cycle[:, None] * self._offset
        qpos = self._qpos[index].copy()
        qpos[:, :3] += offset
        points = self._points[index] + offset[:, None]
        arrays = qpos, self._qvel[index], points, self._moved[index], index / self.steps
        for array in arrays:
            array.setflags(write=False)
        return ClipStep(step, *arrays, None if self._lead is None else self._lead[index])

    def gather(
        self, values: Float[np.ndarray, "S P 3"], step: Int[np.ndarray, " N"]
    ) -> Float[np.ndarray, "N P 3"]:
        """Other points of the clip's steps, world, at each environment's step."""
        cycle, index = self._split(step)
        return np.asarray(values[index] + (cycle[:, None] * self._offset)[:, None])

    def ended(self, step: Int[np.ndarray, " N"]) -> np.ndarray:
        """Whether a clip that is not cyclic has been danced to its end."""
        return np.zeros(len(step), bool) if self.cyclic else step >= self.steps - 1

    def horizon(self, start: Int[np.ndarray, " N"], seconds: float) -> Int[np.ndarray, " N"]:
        """Steps of rollouts: the given time when cyclic, else from each start to the clip's end."""
        if self.cyclic:
            return np.full(len(start), max(1, round(seconds / self.dt)))
        return self.steps - 1 - start

    def _velocities(self) -> Float[np.ndarray, "S K 3"]:
        """Backward differences, as a simulation that is read once a step sees them."""
        before = np.roll(self._points, 1, axis=0)
        before[0] = self._points[-1] - self._offset if self.cyclic else self._points[0]
        result: np.ndarray = (self._points - before) / self.dt
        return result

    def _split(self, step: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        if self.cyclic:
            return step // self.steps, step % self.steps
        return np.zeros_like(step), np.minimum(step, self.steps - 1)
