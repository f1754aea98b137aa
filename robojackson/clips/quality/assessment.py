"""Everything that is measured on a clip in one pass over its frames: Algorithm 1, and beyond it.

The pose detector sees every frame; the other figures are taken from what it found and from small
pictures, a few a second where that serves, so that they cost little beside it.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import Field

from robojackson.clips.people.camera_motion import CameraConfig, CameraMotion
from robojackson.clips.people.person_count import People, PeopleConfig
from robojackson.clips.people.person_extent import full_body, heights_px
from robojackson.clips.pose_detector import Size, detect, still_landmarker
from robojackson.clips.quality.cuts import Changes, CutConfig, leaps, together
from robojackson.clips.quality.drawing import DrawingConfig, Paint
from robojackson.clips.quality.stability import Stability, StabilityConfig, stability
from robojackson.clips.video import VideoInfo, VideoLimits, probe
from robojackson.config import config_dataclass
from robojackson.motion.landmark_track import LandmarkTrack


@config_dataclass
class AssessmentConfig:
    """Configuration of the assessment of a clip.

    Attributes:
        detector: Size of the pose model.
        video, stability, cuts, camera, people, drawing: Configurations of the parts.
    """

    detector: Size = "lite"
    video: VideoLimits = Field(default_factory=VideoLimits)
    stability: StabilityConfig = Field(default_factory=StabilityConfig)
    cuts: CutConfig = Field(default_factory=CutConfig)
    camera: CameraConfig = Field(default_factory=CameraConfig)
    people: PeopleConfig = Field(default_factory=PeopleConfig)
    drawing: DrawingConfig = Field(default_factory=DrawingConfig)


@dataclass(frozen=True)
class Quality:
    """Figures beyond Algorithm 1.

    Attributes:
        frames: Frames in the clip.
        duration_s: Length of the clip, seconds.
        detected_share: Share of frames in which a person was found.
        full_body_share: Share of frames with head, trunk and legs in view.
        person_height_px: Median height of the person in the image, pixels; 0 without one.
        people: People in view in at least a third of the frames that were looked at.
        cuts: Cuts between scenes and jump cuts inside one.
        static_share: Share of the time in which the camera stands still.
        moving_share: Share of frames that differ from the one a tenth of a second before.
        flat_share: Share of the body in flat colour; large in a drawing.
    """

    frames: int
    duration_s: float
    detected_share: float
    full_body_share: float
    person_height_px: float
    people: int
    cuts: int
    static_share: float
    moving_share: float
    flat_share: float


@dataclass(frozen=True)
class Assessment:
    """All figures of a clip.

    Attributes:
        info: The file.
        track: What the pose detector saw.
        stability: Algorithm 1.
        quality: The rest.
    """

    info: VideoInfo
    track: LandmarkTrack
    stability: Stability
    quality: Quality


def assess_video(
    path: Path, config: AssessmentConfig, progress: Callable[[int, int], None] | None = None
) -> Assessment:
    """Measure a clip.

    Raises:
        UnreadableVideo, TruncatedVideo, VideoTooLong, TrackTooShort: of `probe`.
        MissingDependency: no pose model.
    """
    info = probe(path, config.video)
    with still_landmarker(config.detector) as landmarker:
        eyes = _Eyes(info, config, landmarker)
        track = detect(path, info, config.detector, progress, eyes.add_frame)
    score = stability(track, config.stability)
    return Assessment(info, track, score, eyes.quality(track))


class _Eyes:
    """All observers of the frames beside the pose detector."""

    def __init__(self, info: VideoInfo, config: AssessmentConfig, landmarker: Any) -> None:
        self._info, self._config = info, config
        self._changes = Changes(info.fps, config.cuts)
        self._camera = CameraMotion(info.frames, info.fps, config.camera)
        self._people = People(info.frames, info.fps, landmarker, config.people)
        self._paint = Paint(info.frames, info.fps, config.drawing)

    def add_frame(self, index: int, image: np.ndarray, row: np.ndarray) -> None:
        """Add frame number `index`, RGB, and the landmarks found in it, NaN for no person."""
        self._changes.add_frame(image)
        for eye in (self._camera, self._people, self._paint):
            eye.add_frame(index, image, row[:, :2])

    def quality(self, track: LandmarkTrack) -> Quality:
        """Return the figures of the whole clip."""
        config = self._config
        apart = round(config.cuts.shortest_scene_s * self._info.fps)
        cuts = together(self._changes.cuts, leaps(track, config.cuts), apart)
        whole = full_body(track, config.stability.visibility_threshold)
        frames = max(len(track), 1)
        return Quality(
            frames=len(track),
            duration_s=self._info.duration_s,
            detected_share=float(track.detected.sum()) / frames,
            full_body_share=float(whole.sum()) / frames,
            person_height_px=_median(heights_px(track)),
            people=self._people.typical,
            cuts=len(cuts),
            static_share=self._camera.static_share,
            moving_share=self._changes.moving_share,
            flat_share=self._paint.flat_share,
        )


def _median(values: np.ndarray) -> float:
    """Return the median of the numbers that are there, 0 when there are none."""
    known = values[~np.isnan(values)]
    return float(np.median(known)) if len(known) else 0.0
