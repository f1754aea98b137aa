"""A recorded run for a page: player, source pane, sound and beats."""

import base64
import logging
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import Float

from robojackson.clips.video import read_frames
from robojackson.errors import MissingDependency
from robojackson.motion.landmark_track import LandmarkTrack
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.motion.smpl_sequence import SmplSequence
from robojackson.report.video.canvas import Picture
from robojackson.report.video.film import VideoConfig
from robojackson.report.video.soundtrack import soundtrack
from robojackson.report.video.source_film import source_film
from robojackson.report.web.beats import beat_bands, beat_report, music_beats_shown, pictures_danced
from robojackson.report.web.player_data import Player, player
from robojackson.rl.evaluation.controllers import Evaluated
from robojackson.robot.model import Robot

THUMBNAIL_PX, THUMBNAIL_QUALITY = 168, 70

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class RecordedRun:
    """The results of a pass.

    Attributes:
        robot: The robot that danced.
        track, sequence, reference: Landmarks, person and target.
        rollout_qpos: The rollout, from the first step.
        policy: The policy or the tracker that danced; None where it is not known.
    """

    robot: Robot
    track: LandmarkTrack
    sequence: SmplSequence
    reference: ReferenceMotion
    rollout_qpos: Float[np.ndarray, "S nq"] | None
    policy: Evaluated | None


@dataclass(frozen=True)
class ShownRun:
    """The content that a page has of a run.

    Attributes:
        player: The panes.
        film, has_sound: mp4 of the source pane, and whether it has audible sound.
        beats: Beats and their figures; None without music.
    """

    player: Player
    film: bytes
    has_sound: bool
    beats: dict[str, object] | None


def shown_run(run: RecordedRun, clip: Path, config: VideoConfig) -> ShownRun:
    """Return panes, film and beats of a run.

    Raises:
        UnreadableVideo: the music of the configuration cannot be read.
    """
    fps = float(config.fps)
    shown = player(
        run.track, run.sequence, run.reference, run.rollout_qpos, run.robot, fps, config.max_seconds
    )
    seconds = len(shown.when) / fps
    sound = soundtrack(clip, config.music, run.reference, seconds)
    beats = None
    if sound is not None:
        beats = _beats(run, clip, config, shown, seconds)
    if beats is not None:
        shown = replace(shown, bands=[*beat_bands(beats, fps), *shown.bands])
    film = source_film(clip, run.track, shown.when, config, sound)
    return ShownRun(shown, film, sound is not None, beats)


def _beats(
    run: RecordedRun, clip: Path, config: VideoConfig, shown: Player, seconds: float
) -> dict[str, object] | None:
    try:
        music = music_beats_shown(clip, config.music, run.reference, seconds)
    except MissingDependency as missing:
        log.warning("%s", missing)
        return None
    fps = float(config.fps)
    danced = pictures_danced(run.reference, fps, len(shown.when))
    return beat_report(music, shown.points, fps, danced) if len(music) else None


def thumbnail(clip: Path) -> str:
    """Return a small picture of the first frame of a clip, JPEG as base64."""
    return _small(next(iter(read_frames(clip))))


def small_picture(png: bytes) -> str:
    """Return a picture small, JPEG as base64."""
    picture = cv2.imdecode(np.frombuffer(png, np.uint8), cv2.IMREAD_COLOR)
    if picture is None:
        raise ValueError("small_picture: not a picture")
    return _small(cv2.cvtColor(picture, cv2.COLOR_BGR2RGB))


def _small(picture: Picture) -> str:
    scale = THUMBNAIL_PX / min(picture.shape[:2])
    small = cv2.resize(picture, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    options = [cv2.IMWRITE_JPEG_QUALITY, THUMBNAIL_QUALITY]
    _, encoded = cv2.imencode(".jpg", cv2.cvtColor(small, cv2.COLOR_RGB2BGR), options)
    return base64.b64encode(encoded.tobytes()).decode()
