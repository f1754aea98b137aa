"""Cuts, stills and slideshows: how the pictures of a clip follow one another.

PySceneDetect's content detector finds cuts between scenes. A jump cut inside one scene shows in the
person alone: all landmarks leap at once, which no dancer's do.
"""

from collections import deque

import cv2
import numpy as np
from jaxtyping import Float, UInt8
from pydantic import Field

from robojackson.clips.people.person_extent import heights_px
from robojackson.config import config_dataclass
from robojackson.motion.landmark_track import LandmarkTrack

MOVING_S = 0.1


@config_dataclass
class CutConfig:
    """Configuration of finding cuts.

    Attributes:
        threshold: PySceneDetect's change of hue, saturation and lightness at a cut, 0..255.
        shortest_scene_s: Two cuts nearer than this are one, seconds.
        leap: Mean displacement of all landmarks between two frames at a jump cut, body heights.
        leap_speed: The leap as a speed, body heights a second: it counts at low frame rates.
        moving_level: Change of a pixel that is motion and not the noise of the encoder, 0..255.
        moving_share: Least part of a picture that such pixels are when it moves, share.
        short_side: Pixels of the short side of the small pictures that are compared.
    """

    threshold: float = Field(default=27.0, gt=0)
    shortest_scene_s: float = Field(default=0.3, gt=0)
    leap: float = Field(default=0.2, gt=0)
    leap_speed: float = Field(default=6.0, gt=0)
    moving_level: int = Field(default=12, ge=1)
    moving_share: float = Field(default=0.001, gt=0)
    short_side: int = Field(default=96, ge=16)


class Changes:
    """Reads every frame of a clip in order and counts cuts and pictures that moved."""

    def __init__(self, fps: float, config: CutConfig) -> None:
        from scenedetect.detectors import ContentDetector

        self._config, self._fps = config, fps
        shortest = max(1, round(config.shortest_scene_s * fps))
        self._detector = ContentDetector(config.threshold, shortest)
        self._earlier: deque[np.ndarray] = deque(maxlen=max(1, round(MOVING_S * fps)))
        self.frames = 0
        self.moved = 0
        self.cuts: list[int] = []

    def add_frame(self, image: UInt8[np.ndarray, "H W 3"]) -> None:
        """Add the next frame, RGB."""
        from scenedetect import FrameTimecode

        step = max(1, min(image.shape[:2]) // self._config.short_side)
        small = np.ascontiguousarray(image[::step, ::step, ::-1])
        now = FrameTimecode(self.frames, self._fps)
        self.cuts += [cut.frame_num for cut in self._detector.process_frame(now, small)]
        self.moved += bool(self._earlier) and self._moves(small)
        self._earlier.append(small)
        self.frames += 1

    @property
    def moving_share(self) -> float:
        """Share of frames that differ from the one a tenth of a second before; a film has nearly 1,
        a still 0. Not from the one before, since a file of a high rate may repeat each picture."""
        return self.moved / max(self.frames - 1, 1)

    def _moves(self, small: np.ndarray) -> bool:
        level = cv2.absdiff(small, self._earlier[0]).max(-1)
        changed = np.count_nonzero(level > self._config.moving_level)
        return bool(changed > self._config.moving_share * level.size)


def leaps(track: LandmarkTrack, config: CutConfig) -> list[int]:
    """Return frames in which the whole person is suddenly elsewhere: jump cuts inside a scene."""
    speed = displacement(track)
    limit = max(config.leap, config.leap_speed / track.fps)
    return [int(index) + 1 for index in np.flatnonzero(speed > limit)]


def displacement(track: LandmarkTrack) -> Float[np.ndarray, " T-1"]:
    """Return the median displacement of the landmarks from frame to frame, body heights; NaN in
    gaps."""
    size = np.array([track.width, track.height])
    steps = np.linalg.norm(np.diff(track.landmarks[..., :2] * size, axis=0), axis=-1)
    tall = np.nanmedian(heights_px(track)) if track.detected.any() else np.nan
    result: np.ndarray = np.median(steps, axis=1) / tall
    return result


def together(scenes: list[int], jumps: list[int], frames_apart: int) -> list[int]:
    """Return both kinds of cut, those within `frames_apart` of one another counted once."""
    found: list[int] = []
    for frame in sorted((*scenes, *jumps)):
        if not found or frame - found[-1] > frames_apart:
            found.append(frame)
    return found
