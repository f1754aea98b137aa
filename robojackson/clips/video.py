"""Video files: what they hold, their frames and ranges of them.

PyAV reads the container itself, so a rotation tag is honoured and a file that ends before its index
says so is distinguished from one that never was a video. Times in seconds, sizes in upright pixels.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

import av
import numpy as np
from av.video.frame import VideoFrame
from pydantic import Field

from robojackson.clips.upright_frame import upright
from robojackson.clips.video_container import (
    FASTEST,
    declared_rate,
    first_frame,
    frame_step,
    length_s,
    opened,
    packet_times,
    pixel_aspect,
    rate,
    require_complete,
    video_stream,
)
from robojackson.config import config_dataclass
from robojackson.errors import (
    TrackTooShort,
    TruncatedVideo,
    UnreadableVideo,
    VideoTooLong,
)
from robojackson.files.file_tree import FileTree
from robojackson.files.json_types import to_json
from robojackson.motion.landmark_track import uneven

SUFFIXES = (".mp4", ".mov", ".m4v", ".mkv", ".webm", ".avi", ".gif")
TIME_TOLERANCE_S = 1e-6
DAMAGE_ALLOWED = 0.2
"""Share of the frames that may be damaged; they are left out."""
WITHOUT_DISPLAY_TIMES = "avi"
"""Container whose times are of the order in which frames are decoded, not shown: with B-frames
frame n is shown at the n-th of all times."""


@config_dataclass
class VideoLimits:
    """Limits of a clip.

    Attributes:
        max_duration_s: Longest clip, seconds; None is any length.
        min_frames: Fewest frames; motion needs two.
    """

    max_duration_s: float | None = Field(default=60.0, gt=0)
    min_frames: int = Field(default=2, ge=1)


@dataclass(frozen=True)
class VideoInfo:
    """Properties of a video file.

    Attributes:
        path: The file.
        width, height: Size of the upright image, square pixels.
        fps: Mean frames a second that are read, pauses left out.
        uneven: Whether the frames are not evenly spaced, as a phone writes them.
        frames: Number of frames that are read.
        duration_s: From the first frame to the end of the last, seconds.
        rotation: Clockwise degrees that turn a stored image upright, a mirrored one after it was
            flipped upside down: 0, 90, 180 or 270.
        step: Every `step`-th frame of the file is read; 1 below 90 frames a second.
        begin_s: Where it begins in the video that was given, of which it is a range, seconds.
    """

    path: Path
    width: int
    height: int
    fps: float
    frames: int
    duration_s: float
    rotation: int
    uneven: bool = False
    step: int = 1
    begin_s: float = 0.0

    def save(self, path: str | PathLike[str]) -> Path:
        """Write the figures as JSON.

        Returns:
            The path.

        Raises:
            StoreError: the file cannot be written.
        """
        file = Path(path)
        content = to_json(self)
        FileTree(file.parent).write(file.name, content)
        return file


def list_videos(source: Path) -> tuple[Path, ...]:
    """Return the file itself, or the videos directly inside a folder, by name.

    Raises:
        UnreadableVideo: no such file, or a folder without videos.
    """
    if source.is_file():
        return (source,)
    if not source.is_dir():
        raise UnreadableVideo("no such file or folder", source)
    there = (path for path in sorted(source.iterdir()) if path.is_file())
    found = tuple(path for path in there if path.suffix.lower() in SUFFIXES)
    if not found:
        raise UnreadableVideo(f"the folder holds no video ({', '.join(SUFFIXES)})", source)
    return found


def probe(path: Path, limits: VideoLimits) -> VideoInfo:
    """Return the size, rate and number of frames of a video, counted, not taken from the header.

    Raises:
        UnreadableVideo: missing, empty, or not a video.
        TruncatedVideo: the file ends before its index or its last frame.
        VideoTooLong, TrackTooShort: outside the limits.
    """
    with opened(path) as container:
        stream = video_stream(container, path)
        declared, aspect = declared_rate(stream), pixel_aspect(stream)
        promised = stream.frames
    stamps = packet_times(path)
    require_complete(path, len(stamps), promised)
    with opened(path) as container:
        first = first_frame(container, path)
    if len(stamps) > 1 and stamps[-1] == 0.0:
        raise UnreadableVideo(
            f"all of its {len(stamps)} frames are shown at the same time; write it again "
            "with a frame rate (ffmpeg -r 30 -i IN OUT.mp4)",
            path,
        )
    fps = rate(stamps, declared)
    if not fps:
        raise UnreadableVideo("the file declares no frame rate", path)
    if fps > FASTEST:
        raise UnreadableVideo(f"{fps:.0f} frames a second; at most {FASTEST:g} are read", path)
    rotation = -90 * round(first.rotation / 90) % 360  # as pictures are turned (`upright`)
    size = (round(first.width * aspect), first.height)
    size = size[::-1] if rotation % 180 else size
    step = frame_step(fps)
    stamps = stamps[::step]
    fps = rate(stamps, fps / step)
    frames = len(stamps)
    varies = uneven(stamps, fps)
    seconds = length_s(stamps, fps, path) if varies else frames / fps
    info = VideoInfo(path, *size, fps, frames, seconds, rotation, varies, step)
    require_within(info, limits)
    return info


def read_frames(
    path: Path, start_s: float | None = None, end_s: float | None = None
) -> Iterator[np.ndarray]:
    """Return RGB images, uint8, upright, from `start_s` (included) to `end_s` (excluded), in order.

    Raises:
        UnreadableVideo, TruncatedVideo: the file cannot be decoded to its end.
    """
    return (image for _, image in timed_frames(path, start_s, end_s))


def timed_frames(
    path: Path,
    start_s: float | None = None,
    end_s: float | None = None,
    short_side: int | None = None,
) -> Iterator[tuple[float, np.ndarray]]:
    """Yield the same with the time of each since the first frame; damaged frames are left out.

    Args:
        path: Video file.
        start_s, end_s: Range, seconds.
        short_side: Images that are larger by more than a tenth are made smaller until their short
            side has this number of pixels.
    """
    origin = None
    for stamp, frame, aspect in _decoded(path):
        origin = stamp if origin is None else origin
        time_s = stamp - origin
        if end_s is not None and time_s >= end_s - TIME_TOLERANCE_S:
            return
        if start_s is None or time_s >= start_s - TIME_TOLERANCE_S:
            yield time_s, upright(frame, short_side, aspect)


def _decoded(path: Path) -> Iterator[tuple[float, VideoFrame, float]]:
    """Yield timestamps, frames and the aspect of their pixels, of every frame that is read."""
    stamps = packet_times(path)
    with opened(path) as container:
        stream = video_stream(container, path)
        in_order = container.format.name == WITHOUT_DISPLAY_TIMES
        stream.thread_type, aspect = "NONE", pixel_aspect(stream)
        declared = declared_rate(stream)
        step = frame_step(rate(stamps, declared))
        time_s, good, bad = 0.0, 0, 0
        packets = container.demux(stream)
        while True:
            try:
                packet = next(packets, None)
                frames = packet.decode() if packet is not None else []
            except av.FFmpegError as cause:
                bad += 1
                if bad > max(1.0, DAMAGE_ALLOWED * max(good + bad, stream.frames, len(stamps))):
                    raise TruncatedVideo(f"damaged after {time_s:.2f} s ({cause})", path) from cause
                continue
            if packet is None:
                return
            for frame in frames:
                good += 1
                time_s = good / (declared or 1.0) if frame.time is None else float(frame.time)
                if in_order and len(stamps):
                    time_s = float(stamps[min(good + bad, len(stamps)) - 1])
                if (good - 1) % step == 0:
                    yield time_s, frame, aspect


def require_within(info: VideoInfo, limits: VideoLimits) -> None:
    """Raise `VideoTooLong` or `TrackTooShort` where a video is outside the limits."""
    if limits.max_duration_s is not None and info.duration_s > limits.max_duration_s:
        raise VideoTooLong(
            f"{info.duration_s:.1f} s is longer than the limit of "
            f"{limits.max_duration_s:g} s; trim it or raise video.max_duration_s",
            info.path,
        )
    if info.frames < limits.min_frames:
        raise TrackTooShort(
            f"{info.frames} frame, at least {limits.min_frames} are needed", info.path
        )
