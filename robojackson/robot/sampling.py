"""A robot's motion at the frame rate that another project's files have.

qpos in MuJoCo's order: root xyz (metres, world), root quaternion wxyz, hinges (radians). A cyclic
reference gives one cycle: no format of the field can express that a motion repeats.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.robot.resampling import resample
from robojackson.robot.tree_kinematics import difference

XYZW, WXYZ = [1, 2, 3, 0], [3, 0, 1, 2]
"""Places of a quaternion wxyz in xyzw, and of one in xyzw in wxyz."""
_HALF_WIDTH = 0.05
"""Steps to each side of a frame over which its velocity is taken."""


@dataclass(frozen=True)
class SampledMotion:
    """Frames at an even rate.

    Attributes:
        fps: Frames a second; frame t is at t / fps seconds.
        qpos: MuJoCo positions, root quaternion wxyz.
        qvel: MuJoCo velocities: root linear in the world, root angular in the body, hinges; None
            where a file does not give it.
    """

    fps: float
    qpos: Float[np.ndarray, "T nq"]
    qvel: Float[np.ndarray, "T nv"] | None = None

    def __post_init__(self) -> None:
        """Raise `ValueError` for a rate or arrays that are no motion."""
        given = [self.qpos] if self.qvel is None else [self.qpos, self.qvel]
        if not 0.0 < self.fps < np.inf:
            raise ValueError(f"{self.fps!r} frames a second")
        if any(each.ndim != 2 or each.dtype.kind not in "fiu" for each in given):
            raise ValueError("qpos and qvel are not numbers with one row a frame")
        if len({len(each) for each in given}) > 1:
            raise ValueError("qpos and qvel have different numbers of frames")

    def __len__(self) -> int:
        return len(self.qpos)


def sampled(reference: ReferenceMotion, fps: float | None = None) -> SampledMotion:
    """Return the reference motion at `fps`, by the splines of the solver; None keeps its control
    steps."""
    if fps is None:
        return SampledMotion(1.0 / reference.dt, reference.qpos, reference.qvel)
    qpos = np.asarray(reference.qpos, float)
    steps = _steps(reference, fps)
    before, after = steps - _HALF_WIDTH, steps + _HALF_WIDTH
    if not reference.cyclic:
        before, after = np.clip([before, after], 0, len(reference) - 1)
    cycle_offset = np.asarray(reference.cycle_offset, float) if reference.cyclic else None
    moved = difference(resample(qpos, before, cycle_offset), resample(qpos, after, cycle_offset))
    seconds = np.maximum(after - before, _HALF_WIDTH) * reference.dt  # 0 in a motion of one step
    qvel = moved / seconds[:, None]
    return SampledMotion(float(fps), resample(qpos, steps, cycle_offset), qvel)


def frame_count(reference: ReferenceMotion, fps: float | None = None) -> int:
    """Return the number of frames that `sampled` returns."""
    return len(reference) if fps is None else len(_steps(reference, fps))


def _steps(reference: ReferenceMotion, fps: float) -> Float[np.ndarray, " T"]:
    """Return the fractional steps of the frames: up to the last step, or all before the next cycle
    begins."""
    per_frame = 1.0 / (fps * reference.dt)
    if reference.cyclic:
        return np.arange(int(np.ceil(len(reference) / per_frame - 1e-6))) * per_frame
    return np.arange(int((len(reference) - 1) / per_frame + 1e-6) + 1) * per_frame
