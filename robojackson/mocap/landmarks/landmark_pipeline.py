"""The input of a motion: a person's landmarks at a chosen quality, and the camera's path.

"best" averages the two larger pose models; it runs at a third of the speed of "full".
"""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Literal

import cv2
import numpy as np
from jaxtyping import Float, UInt8

from robojackson.clips.people.camera_motion import grey_levels
from robojackson.clips.people.camera_path import CameraFollower
from robojackson.clips.people.dancer import DancerConfig, track_dancer
from robojackson.clips.quality.picture_quality import PictureQuality
from robojackson.clips.upright_frame import NEARLY
from robojackson.clips.video import VideoInfo, timed_frames
from robojackson.mocap.landmarks.model_fusion import fuse_tracks
from robojackson.mocap.landmarks.scene_edges import SHORT_SIDE as EDGES_SIDE
from robojackson.mocap.landmarks.scene_edges import SceneEdges
from robojackson.motion.landmark_track import LandmarkTrack

Quality = Literal["lite", "full", "heavy", "best"]
VOTERS: dict[str, tuple[str, ...]] = {"best": ("full", "heavy")}
"""Pose models of the qualities with several models."""
SHORT_SIDE = 240
"""Short side of the pictures in which the background is tracked, pixels."""

Progress = Callable[[int, int], None]


def models_of(quality: str) -> tuple[str, ...]:
    """Return the pose models of a quality."""
    return VOTERS.get(quality, (quality,))


def detect_landmarks(
    path: Path,
    info: VideoInfo,
    quality: str,
    dancer: DancerConfig,
    progress: Progress | None = None,
) -> LandmarkTrack:
    """Return landmarks of one person, and the movement of the camera.

    Args:
        path: Video file.
        info: Result of `probe`.
        quality: lite, full, heavy or best.
        dancer: Settings of the person's choice.
        progress: Called with (frames done, frames in all) once a frame and model.
    """
    models = models_of(quality)
    tracks, background = [], Background()
    for turn, size in enumerate(models):
        watch = background.add_frame if len(models) == 1 else None
        part = _part(progress, turn, len(models))
        tracks.append(track_dancer(path, info, size, dancer, part, watch))
    if len(tracks) == 1 and background.saw(tracks[0]):
        return background.applied_to(tracks[0])
    return with_camera(path, fuse_tracks(tracks) if len(tracks) > 1 else tracks[0])


def with_camera(path: Path, track: LandmarkTrack) -> LandmarkTrack:
    """Return the track with the path of the camera, notes on it, and the person's visibility."""
    background = Background()
    images = (image for _, image in timed_frames(path, short_side=EDGES_SIDE))
    for index, (image, row) in enumerate(zip(images, track.landmarks, strict=False)):
        background.add_frame(index, image, row)
    return background.applied_to(track)


class Background:
    """Facts from the pictures besides the landmarks, collected frame by frame."""

    def __init__(self) -> None:
        self._people: list[np.ndarray] = []
        self._camera, self._looks = CameraFollower(), PictureQuality()
        self._scene = SceneEdges()

    def add_frame(
        self, index: int, image: UInt8[np.ndarray, "H W 3"], row: Float[np.ndarray, "33 _"]
    ) -> None:
        """Add frame number `index` in RGB, of any size, with the person's landmarks."""
        self._people.append(row[:, :2])
        grey, xy = grey_levels(image), row[:, :2]
        small = shrunk(grey)
        self._scene.add_frame(index, grey)
        self._camera.add_frame(small, xy)
        self._looks.add_frame(small, xy)

    def saw(self, track: LandmarkTrack) -> bool:
        """Return whether the person of the frames so far is that of a track."""
        return np.array_equal(self._people, track.landmarks[..., :2], equal_nan=True)

    def applied_to(self, track: LandmarkTrack) -> LandmarkTrack:
        """Return the track of the same frames with all of these facts."""
        found = self._camera.path(len(track), track.width, track.height)
        return replace(
            track,
            notes=(*track.notes, *found.notes),
            to_first=found.to_first if found.moved else None,
            brightness=self._looks.brightness,
            sharpness=self._looks.sharpness,
            edges=self._scene.edges(found.moved, track.width, track.height),
        )


def shrunk(image: UInt8[np.ndarray, "H W *C"]) -> UInt8[np.ndarray, "h w *C"]:
    """Return the picture with a short side of about `SHORT_SIDE`; whole factors are much faster."""
    factor = max(min(image.shape[:2]) // SHORT_SIDE, 1)
    height, width = (side // factor for side in image.shape[:2])
    if factor > 1:
        whole = np.ascontiguousarray(image[: height * factor, : width * factor])
        image = cv2.resize(whole, (width, height), interpolation=cv2.INTER_AREA)
    if min(height, width) > NEARLY * SHORT_SIDE:
        scale = SHORT_SIDE / min(height, width)
        size = (round(width * scale), round(height * scale))
        image = cv2.resize(image, size, interpolation=cv2.INTER_AREA)
    return np.asarray(image)


def _part(progress: Progress | None, turn: int, turns: int) -> Progress | None:
    """Return the progress of one of several passes as that of all."""
    if progress is None or turns == 1:
        return progress
    return lambda done, total: progress((turn * total + done) // turns, total)
