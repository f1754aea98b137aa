"""All that a motion is made from: a person's landmarks at a chosen quality, the camera's path.

"best" lets the two larger pose models vote; it runs at a third of the speed of "full".
"""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Literal

from robojackson.clips.people.camera_path import camera_path
from robojackson.clips.people.dancer import DancerConfig, track_dancer
from robojackson.clips.quality.picture_quality import PictureQuality
from robojackson.clips.video import VideoInfo, timed_frames
from robojackson.mocap.landmarks.model_fusion import fuse_tracks
from robojackson.motion.landmark_track import LandmarkTrack

Quality = Literal["lite", "full", "heavy", "best"]
VOTERS: dict[str, tuple[str, ...]] = {"best": ("full", "heavy")}
"""Pose models of the qualities that are more than one."""
SHORT_SIDE = 240
"""Pixels of the pictures in which the background is followed."""

Progress = Callable[[int, int], None]


def models_of(quality: str) -> tuple[str, ...]:
    """The pose models that a quality needs."""
    return VOTERS.get(quality, (quality,))


def detect_landmarks(
    path: Path,
    info: VideoInfo,
    quality: str,
    dancer: DancerConfig,
    progress: Progress | None = None,
) -> LandmarkTrack:
    """Landmarks of one person, and how the camera moved meanwhile.

    Args:
        path: Video file.
        info: What `probe` found in it.
        quality: lite, full, heavy or best.
        dancer: Whom to follow.
        progress: Called with (frames done, frames in all) once a frame and model.
    """
    models = models_of(quality)
    tracks = []
    for turn, size in enumerate(models):
        tracks.append(track_dancer(path, info, size, dancer, _part(progress, turn, len(models))))
    return with_camera(path, fuse_tracks(tracks) if len(tracks) > 1 else tracks[0])


def with_camera(path: Path, track: LandmarkTrack) -> LandmarkTrack:
    """The track with the path of the camera, notes of it, and how well the person is seen."""
    images = (image for _, image in timed_frames(path, short_side=SHORT_SIDE))
    marks = track.landmarks[..., :2]
    looks = PictureQuality(marks)
    found = camera_path(looks.watch(images), marks, track.width, track.height)
    return replace(
        track,
        notes=(*track.notes, *found.notes),
        to_first=found.to_first if found.moved else None,
        brightness=looks.brightness,
        sharpness=looks.sharpness,
    )


def _part(progress: Progress | None, turn: int, turns: int) -> Progress | None:
    """Progress of one of several passes as that of all."""
    if progress is None or turns == 1:
        return progress
    return lambda done, total: progress((turn * total + done) // turns, total)
