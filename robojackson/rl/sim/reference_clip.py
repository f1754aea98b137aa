"""Reference motions as arrays that a thousand environments can read, each at its own step.

A cyclic motion continues for ever: step s is step s mod S of cycle s // S, moved by that many cycle
offsets. A motion that is not cyclic holds its last step. Step s of the m-th motion of several is `m
* STRIDE + s`. Frames and units as in `ReferenceMotion`.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from robojackson.errors import RejectedReference, TrackTooShort
from robojackson.motion.reference_motion import ReferenceMotion, motions_of
from robojackson.rl.sim.step_law import Law, StepCorrection

LEAST_STEPS = 8
STRIDE = 1_000_000
"""Distance in steps between the motions of a clip; no episode is as long."""


@dataclass(frozen=True)
class ClipStep:
    """The reference at one step for each of N environments.

    Attributes:
        moved: Velocities of the points, m/s.
        phase: Phase of the motion, 0..1.
        lead: Offset of the motors' targets from the reference's angles, rad; None without one.
        preview: Preview of the steps ahead (`preview.preview_of`); None without one.
        feedback: The offsets of the targets on the way to this step; None without one.
    """

    step: Int[np.ndarray, " N"]
    qpos: Float[np.ndarray, "N nq"]
    qvel: Float[np.ndarray, "N nv"]
    points: Float[np.ndarray, "N K 3"]
    moved: Float[np.ndarray, "N K 3"]
    phase: Float[np.ndarray, " N"]
    lead: Float[np.ndarray, "N nu"] | None = None
    preview: Float[np.ndarray, "N P"] | None = None
    feedback: StepCorrection | None = None

    def angles(self, hinge: Int[np.ndarray, " nu"]) -> Float[np.ndarray, "N nu"]:
        """Return the motors' targets that follow the step, with its lead and without feedback.

        Args:
            hinge: Index of each motor's hinge.
        """
        angles: np.ndarray = self.qpos[:, 7:][:, hinge]
        return angles if self.lead is None else angles + self.lead


class Clip:
    """Random access to reference motions by step.

    Args:
        references: One motion or several, of one robot and control step.
        lead: Offset of the motors' targets from the reference's angles at every step, rad; the
            steps of all motions, one after the other.
        preview: Preview of the steps ahead, of the same steps.
        law: Feedback along the same steps.

    Attributes:
        steps: Number of steps of all motions together.
        cyclic: Whether every motion repeats.
        dt: Seconds a step.

    Raises:
        TrackTooShort, RejectedReference: too few steps, or values that are not finite.
    """

    def __init__(
        self,
        references: ReferenceMotion | Sequence[ReferenceMotion],
        lead: Float[np.ndarray, "S nu"] | None = None,
        preview: Float[np.ndarray, "S P"] | None = None,
        law: Law | None = None,
    ) -> None:
        motions = motions_of(references)
        for motion in motions:
            require_usable(motion)
        self._length = np.array([len(motion) for motion in motions])
        self._first = np.cumsum(self._length) - self._length
        self._cyclic = np.array([motion.cyclic for motion in motions])
        self._offset = np.stack([np.asarray(motion.cycle_offset, float) for motion in motions])
        self.steps, self.dt = int(self._length.sum()), motions[0].dt
        self.cyclic = bool(self._cyclic.all())
        self._qpos = np.concatenate([np.asarray(motion.qpos, float) for motion in motions])
        self._qvel = np.concatenate([np.asarray(motion.qvel, float) for motion in motions])
        self._points = np.concatenate([np.asarray(m.keypoints_w, float) for m in motions])
        self._moved = np.concatenate([_velocities(motion) for motion in motions])
        self._lead, self._preview, self._law = lead, preview, law
        self._last: ClipStep | None = None

    @property
    def outline(self) -> Float[np.ndarray, "M J"] | None:
        """Outline of the path that the feedback keeps robots on (`Law.outline`); None without
        one."""
        return None if self._law is None else self._law.outline

    def starts(self) -> Int[np.ndarray, " R"]:
        """Return the steps from which a motion can be followed: all but the end of one that
        ends."""
        usable = np.where(self._cyclic, self._length, np.maximum(1, self._length - 1))
        return np.concatenate([m * STRIDE + np.arange(count) for m, count in enumerate(usable)])

    def row(self, step: Int[np.ndarray, " N"]) -> Int[np.ndarray, " N"]:
        """Return rows of the joined steps of all motions, without the end of those that end."""
        usable = np.where(self._cyclic, self._length, np.maximum(1, self._length - 1))
        motion, index = np.divmod(step, STRIDE)
        result: np.ndarray = (np.cumsum(usable) - usable)[motion] + index % usable[motion]
        return result

    def folded(self, step: Int[np.ndarray, " N"]) -> Int[np.ndarray, " N"]:
        """Return the same steps within the first cycle of their motions."""
        motion, index = np.divmod(step, STRIDE)
        result: np.ndarray = motion * STRIDE + index % self._length[motion]
        return result

    def repeats(self, step: Int[np.ndarray, " N"]) -> np.ndarray:
        """Return whether the motion of each step is cyclic."""
        result: np.ndarray = self._cyclic[step // STRIDE]
        return result

    def at(self, step: Int[np.ndarray, " N"]) -> ClipStep:
        """Return the reference at each environment's step; read-only. Two calls in a row, such as
        the end of one control step and the beginning of the next, are computed once."""
        if self._last is None or not np.array_equal(self._last.step, step):
            self._last = self._read(np.array(step))
        return self._last

    def _read(self, step: Int[np.ndarray, " N"]) -> ClipStep:
        row, shift, phase = self._split(step)
        qpos = self._qpos[row].copy()
        qpos[:, :3] += shift
        points = self._points[row] + shift[:, None]
        arrays = qpos, self._qvel[row], points, self._moved[row], phase
        for array in arrays:
            array.setflags(write=False)
        lead = None if self._lead is None else self._lead[row]
        preview = None if self._preview is None else self._preview[row]
        return ClipStep(step, *arrays, lead, preview, self._feedback(step))

    def _feedback(self, step: np.ndarray) -> StepCorrection | None:
        """Return the feedback on the way to each step."""
        return None if self._law is None else _Correction(self._law, self, step)

    def before(self, step: Int[np.ndarray, " N"]) -> tuple[np.ndarray, np.ndarray]:
        """Return the row of the step before each, and the displacement by its cycles."""
        row, shift, _ = self._split(step - 1)
        return row, shift

    def gather(
        self, values: Float[np.ndarray, "S P 3"], step: Int[np.ndarray, " N"]
    ) -> Float[np.ndarray, "N P 3"]:
        """Return other points of the clip's steps, world, at each environment's step."""
        row, shift, _ = self._split(step)
        return np.asarray(values[row] + shift[:, None])

    def ended(self, step: Int[np.ndarray, " N"]) -> np.ndarray:
        """Return whether a motion that is not cyclic has been danced to its end."""
        if self.cyclic:
            return np.zeros(len(step), bool)
        motion, index = np.divmod(step, STRIDE)
        result: np.ndarray = ~self._cyclic[motion] & (index >= self._length[motion] - 1)
        return result

    def horizon(self, start: Int[np.ndarray, " N"], seconds: float) -> Int[np.ndarray, " N"]:
        """Return steps of rollouts: the given time if cyclic, else from each start to the clip's
        end."""
        if self.cyclic:
            return np.full(len(start), max(1, round(seconds / self.dt)))
        return self.steps - 1 - start

    def _split(
        self, step: np.ndarray
    ) -> tuple[Int[np.ndarray, " N"], Float[np.ndarray, "N 3"], Float[np.ndarray, " N"]]:
        """Return rows of the joined arrays, the displacement by the cycles, and the phase."""
        motion, index = np.divmod(step, STRIDE)
        length = self._length[motion]
        cycle = np.where(self._cyclic[motion], index // length, 0)
        index = np.minimum(index - cycle * length, length - 1)
        shift: np.ndarray = cycle[:, None] * self._offset[motion]
        return self._first[motion] + index, shift, index / length


@dataclass(frozen=True)
class _Correction:
    """The feedback of N robots on the way to a step (`StepCorrection` protocol)."""

    law: Law
    clip: Clip
    step: Int[np.ndarray, " N"]

    def __call__(
        self,
        qpos: Float[np.ndarray, "N nq"],
        qvel: Float[np.ndarray, "N nv"],
        beside_feet: bool = False,
    ) -> Float[np.ndarray, "N nu"]:
        """Return the offsets of the targets, rad."""
        return self.law.at(*self.clip.before(self.step), beside_feet).targets(qpos, qvel)

    def path(self) -> tuple[Float[np.ndarray, "N nq"], Float[np.ndarray, "N nv"]]:
        """Return the states that the feedback keeps robots in, before the step."""
        return self.law.path(*self.clip.before(self.step))


def require_usable(motion: ReferenceMotion) -> None:
    """Raise for a motion that no robot can follow.

    Raises:
        TrackTooShort, RejectedReference: too few steps, or values that are not finite.
    """
    if len(motion) < LEAST_STEPS:
        raise TrackTooShort(
            f"the reference motion has {len(motion)} steps, {LEAST_STEPS} are the least"
        )
    if not np.isfinite(motion.qpos).all() or not np.isfinite(motion.qvel).all():
        raise RejectedReference("the reference motion holds values that are not finite")


def _velocities(motion: ReferenceMotion) -> Float[np.ndarray, "S K 3"]:
    """Return backward differences, like those of a simulation that is read once a step."""
    points = np.asarray(motion.keypoints_w, float)
    before = np.roll(points, 1, axis=0)
    before[0] = points[-1] - motion.cycle_offset if motion.cyclic else points[0]
    result: np.ndarray = (points - before) / motion.dt
    return result
