"""A picture of a move: video frame, recovered body and robot, at a few moments (Figures 2-4)."""

from contextlib import ExitStack
from itertools import islice
from pathlib import Path

import cv2
import mujoco
import numpy as np
from jaxtyping import UInt8

from robojackson.clips.video import read_frames
from robojackson.motion.landmark_track import LandmarkTrack
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.motion.smpl_sequence import SmplSequence
from robojackson.report.video.robot_panel import REFERENCE_TINT
from robojackson.report.video.side_by_side import Film, VideoConfig
from robojackson.report.video.timeline import Timeline, reference_qpos

MOMENTS = (0.2, 0.5, 0.8)
"""Shares of the motion that are shown."""


def still(
    source: Path,
    track: LandmarkTrack,
    sequence: SmplSequence,
    reference: ReferenceMotion,
    model: mujoco.MjModel,
    config: VideoConfig | None = None,
) -> bytes:
    """The picture as PNG, three panels a moment, in one row.

    Raises:
        MissingDependency: no way to draw without a screen.
    """
    config = config or VideoConfig(panel_width=240, panel_height=360)
    when = _moments(reference, sequence)
    with ExitStack() as stack:
        film = Film(stack, source, track, sequence, config, when)
        film.add_robot("reference", reference_qpos(reference, when), model, REFERENCE_TINT)
        row = np.concatenate(list(film.pictures()), axis=1)
    return _png(row)


def middle_of(film: Path) -> bytes:
    """Return the picture in the middle of a video, as PNG.

    Raises:
        UnreadableVideo, TruncatedVideo: the file cannot be decoded to its end.
    """
    frames = sum(1 for _ in read_frames(film))
    return _png(next(islice(read_frames(film), frames // 2, None)))


def _png(rgb: UInt8[np.ndarray, "H W 3"]) -> bytes:
    return bytes(cv2.imencode(".png", rgb[..., ::-1])[1])


def _moments(reference: ReferenceMotion, sequence: SmplSequence) -> Timeline:
    step = np.array([int(share * (len(reference) - 1)) for share in MOMENTS])
    frame = np.round(np.asarray(reference.source_time_s)[step] * sequence.fps).astype(int)
    still_there = np.zeros(len(step), bool)
    return Timeline(
        time_s=step * reference.dt,
        step=step,
        cycle=np.zeros(len(step), int),
        frame=np.clip(frame, 0, len(sequence) - 1),
        rollout=np.zeros(len(step), int),
        ended=still_there,
    )
