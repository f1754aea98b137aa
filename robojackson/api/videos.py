"""Videos: what a file holds, and the landmarks of the person in it."""

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
from jaxtyping import UInt8

from robojackson.api.arguments import FilePath, Progress, counter
from robojackson.clips import video as video_files
from robojackson.clips.people.dancer import DancerConfig
from robojackson.clips.video import VideoInfo, VideoLimits
from robojackson.errors import BadConfiguration
from robojackson.mocap.landmarks import landmark_pipeline
from robojackson.mocap.landmarks.landmark_pipeline import Quality
from robojackson.motion.landmark_track import LandmarkTrack

Frames = UInt8[np.ndarray, "T H W 3"]


def probe_video(video: FilePath, *, limits: VideoLimits | None = None) -> VideoInfo:
    """Read the size, rate and number of frames of a video; the frames are counted.

    Args:
        video: File of any format that FFmpeg reads.
        limits: Longest and shortest clip; 60 s and 2 frames by default.

    Returns:
        Upright size in pixels, frames a second, duration in seconds, rotation in degrees.

    Raises:
        UnreadableVideo: missing, empty, or not a video.
        TruncatedVideo: the file ends before its index or its last frame.
        VideoTooLong, TrackTooShort: outside the limits.
    """
    return video_files.probe(Path(video), limits or VideoLimits())


def detect_landmarks(
    video: FilePath | Frames,
    *,
    fps: float | None = None,
    quality: Quality = "full",
    person: int | None = None,
    limits: VideoLimits | None = None,
    config: DancerConfig | None = None,
    progress: Progress = False,
) -> LandmarkTrack:
    """Track one person: MediaPipe's 33 landmarks in every frame.

    Args:
        video: File, or frames (T, H, W, 3) as uint8 RGB.
        fps: Frames a second of an array; a file has its own.
        quality: Pose model: lite, full, heavy, or best, which lets two vote.
        person: Number of the person to follow; 1, and None, is the largest steady one.
        limits: Longest and shortest clip.
        config: Everything else about how the person is found.
        progress: True shows a bar; a function is called with (frames done, frames in all).

    Returns:
        Image landmarks (T, 33, 3), divided by width and height; world landmarks (T, 33, 3), metres
        from the hips; visibility (T, 33), 0..1. Undetected frames are NaN.

    Raises:
        UnreadableVideo, TruncatedVideo, VideoTooLong, TrackTooShort: see `probe_video`.
        NoPersonFound: there is no person of that number.
        MissingDependency: the pose model or a graphics library is not installed.
        BadConfiguration: an array without `fps`, or of another shape or type.
    """
    dancer = config or DancerConfig()
    if person is not None:
        dancer = replace(dancer, number=person)
    with _as_file(video, fps) as path:
        info = probe_video(path, limits=limits)
        with counter(progress, f"landmarks of {path.name}") as count:
            return landmark_pipeline.detect_landmarks(path, info, quality, dancer, count)


@contextmanager
def _as_file(video: FilePath | Frames, fps: float | None) -> Iterator[Path]:
    """Yield the path of a video; an array becomes a temporary lossless file."""
    if not isinstance(video, np.ndarray):
        yield Path(video)
        return
    if video.ndim != 4 or video.shape[-1] != 3 or video.dtype != np.uint8:
        raise BadConfiguration(
            f"frames have shape {video.shape} and type {video.dtype}; needed: (T, H, W, 3), uint8"
        )
    if not fps or not np.isfinite(fps) or fps <= 0:
        raise BadConfiguration(f"fps is {fps!r}: an array of frames needs frames a second")
    with tempfile.TemporaryDirectory(prefix="robojackson-") as folder:
        path = Path(folder) / "frames.mkv"
        _write_lossless(video, fps, path)
        yield path


def _write_lossless(frames: Frames, fps: float, path: Path) -> None:
    with av.open(f"file:{path.absolute()}", "w") as container:
        stream = container.add_stream("ffv1", rate=Fraction(fps).limit_denominator(1001))
        stream.height, stream.width, stream.pix_fmt = frames.shape[1], frames.shape[2], "bgr0"
        for frame in frames:
            container.mux(stream.encode(av.VideoFrame.from_ndarray(frame, format="rgb24")))
        container.mux(stream.encode())
