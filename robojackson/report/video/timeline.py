"""Frames of the clip and steps of the robot for each picture of the video.

Time 0 is the first step of the reference motion. A cyclic reference and its source repeat; another
reference holds its last step. Seconds.
"""

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.motion.smpl_sequence import SmplSequence


@dataclass(frozen=True)
class Timeline:
    """One row a picture.

    Attributes:
        time_s: Time since the first step, seconds.
        step: Step of the reference motion.
        cycle: Number of completed cycles of the reference.
        frame: Frame of the source clip.
        rollout: Step of the trained robot's rollout; its last one after the end.
        ended: Whether the rollout is over.
        cycle_frames: Places in the clip, frames, where a cycle begins and where the next one does;
            equal where nothing repeats.
    """

    time_s: Float[np.ndarray, " N"]
    step: Int[np.ndarray, " N"]
    cycle: Int[np.ndarray, " N"]
    frame: Int[np.ndarray, " N"]
    rollout: Int[np.ndarray, " N"]
    ended: Bool[np.ndarray, " N"]
    cycle_frames: tuple[float, float] = (0.0, 0.0)

    def __len__(self) -> int:
        return len(self.time_s)


def timeline(
    reference: ReferenceMotion,
    source_fps: float,
    source_frames: int,
    rollout_steps: int,
    fps: float,
    max_seconds: float,
) -> Timeline:
    """Return pictures at `fps` over the longer of rollout and one cycle, up to `max_seconds`."""
    seconds = min(max(rollout_steps, len(reference)) * reference.dt, max_seconds)
    time_s = np.arange(max(1, round(seconds * fps))) / fps
    elapsed = np.floor(time_s / reference.dt + 1e-6).astype(int)
    cycle = elapsed // len(reference) if reference.cyclic else np.zeros_like(elapsed)
    step = np.minimum(elapsed - cycle * len(reference), len(reference) - 1)
    source = np.asarray(reference.source_time_s) * source_fps
    frame = np.round(source[step]).astype(int)
    ends = np.append(source, source[-1] + np.diff(source)[-1:])[[0, -1]]
    return Timeline(
        time_s=time_s,
        step=step,
        cycle=cycle,
        frame=np.clip(frame, 0, source_frames - 1),
        rollout=np.clip(elapsed, 0, max(rollout_steps - 1, 0)),
        ended=elapsed >= rollout_steps,
        cycle_frames=(float(ends[0]), float(ends[1])) if reference.cyclic else (0.0, 0.0),
    )


def cut_note(reference: ReferenceMotion, shown_s: float, fps: float) -> str:
    """Return how much of a dance is shown, with the setting that shows all of it; empty for a whole
    one.

    Args:
        shown_s: Length of the pictures, seconds.
        fps: Pictures a second.
    """
    whole_s = len(reference) * reference.dt
    if whole_s - shown_s <= 1 / fps:
        return ""
    return (
        f"The first {shown_s:.1f} s of {whole_s:.1f} s are shown, here and in the video: "
        f"--set render.max_seconds={math.ceil(whole_s)} shows the whole dance."
    )


def clip_timeline(
    source_fps: float, source_frames: int, fps: float, max_seconds: float
) -> Timeline:
    """Return pictures at `fps` over a clip, up to `max_seconds`, without a robot."""
    seconds = min(source_frames / source_fps, max_seconds)
    time_s = np.arange(max(1, round(seconds * fps))) / fps
    return at_frames(np.round(time_s * source_fps).astype(int), source_fps, source_frames)


def at_frames(frames: Int[np.ndarray, " N"], source_fps: float, source_frames: int) -> Timeline:
    """Return given frames of a clip, without a robot."""
    none = np.zeros(len(frames), int)
    return Timeline(
        time_s=frames / source_fps,
        step=none,
        cycle=none,
        frame=np.clip(frames, 0, source_frames - 1),
        rollout=none,
        ended=np.zeros(len(frames), bool),
    )


def reference_qpos(reference: ReferenceMotion, when: Timeline) -> Float[np.ndarray, "N nq"]:
    """Return the reference's positions at each picture, moved on by the cycles before."""
    qpos = np.array(reference.qpos, dtype=float)[when.step]
    qpos[:, :3] += when.cycle[:, None] * np.asarray(reference.cycle_offset)
    result: np.ndarray = qpos
    return result


def person_points(sequence: SmplSequence, when: Timeline) -> Float[np.ndarray, "N 29 3"]:
    """Return the person's keypoints at each picture, metres, moved on over the floor by the cycles
    before: by the path of the pelvis in one, at an even speed past the end of the clip."""
    points = np.asarray(sequence.keypoints_w, float)
    floor = points[:, 0, :2]
    path = np.concatenate([floor, 2 * floor[-1:] - floor[-2:][:1]])
    begin, end = (
        [np.interp(at, np.arange(len(path)), axis) for axis in path.T] for at in when.cycle_frames
    )
    travel = np.append(np.subtract(end, begin), 0.0)
    shown = points[np.minimum(when.frame, len(points) - 1)]
    result: np.ndarray = shown + when.cycle[:, None, None] * travel
    return result
