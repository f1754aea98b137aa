"""Pictures of a move at a few moments: video frame, recovered body and robot (Figures 2-4)."""

from collections.abc import Sequence
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
from robojackson.report.video.film import SIDE_DEG, Film, VideoConfig
from robojackson.report.video.robot_panel import REFERENCE_TINT
from robojackson.report.video.timeline import Timeline, at_frames, reference_qpos

MOMENTS = (0.2, 0.5, 0.8)
"""Shares of the motion that are shown."""
SHEET_MOMENTS = (0.05, 0.275, 0.5, 0.725, 0.95)
SHEET = VideoConfig(panel_width=240, panel_height=330)
"""Number of moments of a sheet."""


def still(
    source: Path,
    track: LandmarkTrack,
    sequence: SmplSequence,
    reference: ReferenceMotion,
    model: mujoco.MjModel,
    config: VideoConfig | None = None,
) -> bytes:
    """Return the picture as PNG, three panels a moment, in one row.

    Raises:
        MissingDependency: no way to draw without a screen.
    """
    config = config or VideoConfig(panel_width=240, panel_height=360)
    when = _moments(reference, sequence, MOMENTS)
    with ExitStack() as stack:
        film = Film(stack, config, when, still=True)
        film.add_source(source, track, None, plain=False)
        film.add_body(sequence)
        film.add_robot("reference robot", reference_qpos(reference, when), model, REFERENCE_TINT)
        row = np.concatenate(list(film.pictures()), axis=1)
    return _png(row)


def body_sheet(source: Path, track: LandmarkTrack, sequence: SmplSequence) -> bytes:
    """Return a PNG of a recovered motion: over the source, from the front, from its left side.

    Args:
        source, track: The clip and its landmarks.
    """
    frames = np.round(np.array(SHEET_MOMENTS) * (len(sequence) - 1)).astype(int)
    with ExitStack() as stack:
        film = Film(stack, SHEET, at_frames(frames, sequence.fps, len(sequence)), still=True)
        film.add_source(source, track, sequence, plain=False)
        film.add_body(sequence, "body, front")
        film.add_body(sequence, "body, left side", SIDE_DEG)
        return _png(film.sheet())


def robot_poses(
    source: Path | None,
    track: LandmarkTrack | None,
    sequence: SmplSequence,
    reference: ReferenceMotion,
    model: mujoco.MjModel,
) -> bytes:
    """Return a PNG of a robot's motion: the source if known, the person, the robot from two sides.

    Args:
        source, track: The clip and its landmarks; both or neither.
    Raises:
        MissingDependency: no way to draw without a screen.
    """
    when = _moments(reference, sequence, SHEET_MOMENTS)
    qpos = reference_qpos(reference, when)
    with ExitStack() as stack:
        film = Film(stack, SHEET, when, still=True)
        if source is not None and track is not None:
            film.add_source(source, track, sequence, plain=False)
        film.add_body(sequence, "person")
        film.add_robot("robot, front", qpos, model, REFERENCE_TINT)
        film.add_robot("robot, left side", qpos, model, REFERENCE_TINT, SIDE_DEG)
        return _png(film.sheet())


def middle_of(film: Path) -> bytes:
    """Return the picture in the middle of a video, as PNG.

    Raises:
        UnreadableVideo, TruncatedVideo: the file cannot be decoded to its end.
    """
    frames = sum(1 for _ in read_frames(film))
    return _png(next(islice(read_frames(film), frames // 2, None)))


def _png(rgb: UInt8[np.ndarray, "H W 3"]) -> bytes:
    return bytes(cv2.imencode(".png", rgb[..., ::-1])[1])


def _moments(
    reference: ReferenceMotion, sequence: SmplSequence, shares: Sequence[float]
) -> Timeline:
    step = np.array([int(share * (len(reference) - 1)) for share in shares])
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
