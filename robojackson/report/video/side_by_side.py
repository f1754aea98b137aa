"""The video of a run: source, skeleton, reference robot and trained robot side by side.

A panel is shown if its input is given. All show the same moment. The cameras have the direction of
the one that filmed, in front (+x), and follow their subject over the floor.
"""

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import mujoco
import numpy as np
from jaxtyping import Float

from robojackson.clips.sound import Sound
from robojackson.motion.landmark_track import LandmarkTrack
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.motion.smpl_sequence import SmplSequence
from robojackson.report.video import canvas
from robojackson.report.video.encoder import write_video
from robojackson.report.video.film import SIDE_DEG, Film, panels_of
from robojackson.report.video.film import VideoConfig as VideoConfig
from robojackson.report.video.robot_panel import REFERENCE_TINT, TRAINED_TINT
from robojackson.report.video.soundtrack import soundtrack
from robojackson.report.video.timeline import clip_timeline, reference_qpos, timeline

Progress = Callable[[int, int], None]
TRAINED_TITLE = "trained robot"


def side_by_side(
    source: Path | None,
    track: LandmarkTrack | None,
    sequence: SmplSequence | None,
    reference: ReferenceMotion,
    rollout_qpos: Float[np.ndarray, "S nq"] | None,
    out: Path,
    *,
    model: mujoco.MjModel,
    config: VideoConfig | None = None,
    progress: Progress | None = None,
    plain: bool = False,
    title: str = TRAINED_TITLE,
) -> Path:
    """Write the mp4; an input of None has no panel.

    Args:
        source, track: The clip and its landmarks; both or neither.
        sequence: The motion of the person.
        rollout_qpos: The trained robot at the reference's control step, from its first step on;
            may be longer than a cycle, and ends where the robot fell.
        model: The robot that qpos belongs to.
        progress: Called with (pictures done, pictures in all).
        plain: Whether to show the plain source, too, and the recovered skeleton over it instead of
            the landmarks.
        title: Title of the rollout's panel.
    Raises:
        MissingDependency: no way to draw without a screen.
    """
    config = config or VideoConfig()
    whole = config.shape == "row"
    danced = rollout_qpos is not None and len(rollout_qpos) > 0
    with_source = source is not None and track is not None and (whole or not config.alone)
    config = panels_of(config, 1 + with_source)
    steps = 0 if rollout_qpos is None else len(rollout_qpos)
    filmed = [each for each in (track, sequence) if each is not None]
    fps, frames = (filmed[0].fps, len(filmed[-1])) if filmed else (1.0, 1)
    when = timeline(reference, fps, frames, steps, float(config.fps), config.max_seconds)
    with ExitStack() as stack:
        film = Film(stack, config, when)
        if with_source and source is not None and track is not None:
            film.add_source(source, track, sequence if plain else None, plain)
        if sequence is not None and whole:
            film.add_body(sequence)
        if whole or not danced:
            film.add_robot(
                "reference robot", reference_qpos(reference, when), model, REFERENCE_TINT
            )
        if rollout_qpos is not None and danced:
            qpos = rollout_qpos[when.rollout]
            film.add_robot(title, qpos, model, TRAINED_TINT, is_rollout=True)
        heard = soundtrack(source, config.music, reference, len(when) / config.fps)
        return _written(film, len(when), config, out, progress, heard)


def body_video(
    source: Path,
    track: LandmarkTrack,
    sequence: SmplSequence,
    out: Path,
    config: VideoConfig | None = None,
    progress: Progress | None = None,
) -> Path:
    """Write the mp4 of a recovered motion: source, skeleton over source, body from two sides.

    Args:
        source, track: The clip and its landmarks.
        sequence: The recovered motion.
        progress: Called with (pictures done, pictures in all).
    """
    config = config or VideoConfig()
    when = clip_timeline(sequence.fps, len(sequence), float(config.fps), config.max_seconds)
    with ExitStack() as stack:
        film = Film(stack, config, when)
        film.add_source(source, track, sequence, plain=True)
        film.add_body(sequence, "body, front")
        film.add_body(sequence, "body, left side", SIDE_DEG)
        heard = soundtrack(source, config.music, None, len(when) / config.fps)
        return _written(film, len(when), config, out, progress, heard)


def _written(
    film: Film,
    total: int,
    config: VideoConfig,
    out: Path,
    progress: Progress | None,
    sound: Sound | None,
) -> Path:
    def counted() -> Iterator[canvas.Picture]:
        for done, picture in enumerate(film.pictures(), start=1):
            yield picture
            if progress:
                progress(done, total)

    return write_video(counted(), config.fps, out, config.quality, sound)
