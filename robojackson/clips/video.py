"""Video files: what they hold, their frames and ranges of them.

PyAV reads the container itself, so a rotation tag is honoured and a file that ends before its index
says so is told apart from one that never was a video. Times in seconds, sizes in upright pixels.
"""

import os
import tempfile
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
from av.video.frame import VideoFrame
from av.video.stream import VideoStream
from pydantic import ConfigDict
from pydantic.dataclasses import dataclass

from robojackson.errors import (
    TrackTooShort,
    TruncatedVideo,
    UnreadableVideo,
    VideoTooLong,
)

SUFFIXES = (".mp4", ".mov", ".m4v", ".mkv", ".webm", ".avi", ".gif")
ISO_MEDIA_MARK = b"ftyp"
TIME_TOLERANCE_S = 1e-6
MISSING_FRAMES_ALLOWED = 2
"""Frames that an index may promise beyond those in the file: some writers count one too many."""


@dataclass(frozen=True, config=ConfigDict(extra="forbid"))
class VideoLimits:
    """What a clip may be.

    Attributes:
        max_duration_s: Longest clip, seconds.
        min_frames: Fewest frames; motion needs two.
    """

    max_duration_s: float = 60.0
    min_frames: int = 2


@dataclass(frozen=True)
class VideoInfo:
    """What a video file holds.

    Attributes:
        path: The file.
        width, height: Size of the upright image, pixels.
        fps: Mean frames a second.
        frames: Number of frames in the file.
        duration_s: frames / fps, seconds.
        rotation: Clockwise degrees that turn a stored image upright: 0, 90, 180 or 270.
    """

    path: Path
    width: int
    height: int
    fps: float
    frames: int
    duration_s: float
    rotation: int


def list_videos(source: Path) -> tuple[Path, ...]:
    """The file itself, or the videos directly inside a folder, by name.

    Raises:
        UnreadableVideo: no such file, or a folder without videos.
    """
    if source.is_file():
        return (source,)
    if not source.is_dir():
        raise UnreadableVideo(f"{source}: no such file or folder")
    found = tuple(p for p in sorted(source.iterdir()) if p.suffix.lower() in SUFFIXES)
    if not found:
        raise UnreadableVideo(f"{source}: the folder holds no video ({', '.join(SUFFIXES)})")
    return found


def probe(path: Path, limits: VideoLimits) -> VideoInfo:
    """Size, rate and number of frames of a video, counted and not believed.

    Raises:
        UnreadableVideo: missing, empty, or not a video.
        TruncatedVideo: the file ends before its index or its last frame.
        VideoTooLong, TrackTooShort: outside the limits.
    """
    with _open(path) as container:
        stream = _video_stream(container, path)
        rate = stream.average_rate or stream.guessed_rate
        promised = stream.frames
        first = _first_frame(container, path)
    rotation = -first.rotation % 360
    frames = _count_frames(path)
    _require_whole(path, frames, promised)
    if not rate:
        raise UnreadableVideo(f"{path}: the file tells no frame rate")
    fps = float(rate)
    upright = (first.height, first.width) if rotation % 180 else (first.width, first.height)
    info = VideoInfo(path, *upright, fps, frames, frames / fps, rotation)
    require_within(info, limits)
    return info


def read_frames(
    path: Path, start_s: float | None = None, end_s: float | None = None
) -> Iterator[np.ndarray]:
    """RGB images, uint8, upright, from `start_s` (included) to `end_s` (excluded), in order.

    Raises:
        UnreadableVideo, TruncatedVideo: the file cannot be decoded to its end.
    """
    with _open(path) as container:
        stream = _video_stream(container, path)
        stream.thread_type = "NONE"
        origin, time_s = None, 0.0
        try:
            for frame in container.decode(stream):
                stamp = float(frame.time or 0.0)
                origin = stamp if origin is None else origin
                time_s = stamp - origin
                if end_s is not None and time_s >= end_s - TIME_TOLERANCE_S:
                    return
                if start_s is None or time_s >= start_s - TIME_TOLERANCE_S:
                    yield _upright(frame)
        except av.FFmpegError as cause:
            raise TruncatedVideo(f"{path}: damaged after {time_s:.2f} s ({cause})") from cause


def trim(path: Path, start_s: float, end_s: float, out: Path) -> Path:
    """Re-encode a range of a video (H.264, upright, same rate); `out` is whole or absent.

    A copy of packets would start at the key frame before `start_s`; a re-encoding starts where it
    was told to.

    Raises:
        TrackTooShort: the range holds no frame.
    """
    with _open(path) as container:
        stream = _video_stream(container, path)
        rate = stream.average_rate or Fraction(30)
    handle, name = tempfile.mkstemp(suffix=".mp4", dir=out.parent)
    os.close(handle)
    written = Path(name)
    try:
        if not _encode(read_frames(path, start_s, end_s), rate, written):
            raise TrackTooShort(f"{path}: no frame between {start_s:g} s and {end_s:g} s")
        written.replace(out)
    finally:
        written.unlink(missing_ok=True)
    return out


def _encode(images: Iterator[np.ndarray], rate: Fraction, out: Path) -> int:
    """Write images as H.264; returns how many there were."""
    count = 0
    with av.open(str(out), "w", format="mp4") as container:
        stream = container.add_stream("libx264", rate=rate, options={"crf": "17"})
        stream.pix_fmt = "yuv420p"
        for image in images:
            even = image[: image.shape[0] // 2 * 2, : image.shape[1] // 2 * 2]
            if count == 0:
                stream.height, stream.width = even.shape[:2]
            count += 1
            container.mux(stream.encode(VideoFrame.from_ndarray(np.ascontiguousarray(even))))
        if count:
            container.mux(stream.encode(None))
    return count


def _upright(frame: VideoFrame) -> np.ndarray:
    image = frame.to_ndarray(format="rgb24")
    return np.ascontiguousarray(np.rot90(image, round(frame.rotation / 90) % 4))


def _open(path: Path) -> av.container.InputContainer:
    if path.is_dir():
        raise UnreadableVideo(f"{path}: a folder, expected one video")
    if not path.is_file():
        raise UnreadableVideo(f"{path}: no such file")
    if path.stat().st_size == 0:
        raise UnreadableVideo(f"{path}: the file is empty (0 bytes)")
    try:
        return av.open(str(path))
    except av.FFmpegError as cause:
        with path.open("rb") as file:
            is_media = ISO_MEDIA_MARK in file.read(32)
        if is_media:
            message = f"{path}: cut off before its index; copy or download the file again"
            raise TruncatedVideo(message) from cause
        raise UnreadableVideo(f"{path}: not a video that FFmpeg can read") from cause


def _video_stream(container: av.container.InputContainer, path: Path) -> VideoStream:
    if not container.streams.video:
        raise UnreadableVideo(f"{path}: the file holds no video stream")
    return container.streams.video[0]


def _first_frame(container: av.container.InputContainer, path: Path) -> VideoFrame:
    try:
        return next(iter(container.decode(video=0)))
    except (StopIteration, av.FFmpegError) as cause:
        raise UnreadableVideo(f"{path}: the file holds no frame that can be decoded") from cause


def _count_frames(path: Path) -> int:
    """Packets of the video stream: nothing is decoded, so a minute takes milliseconds."""
    with _open(path) as container:
        try:
            packets = container.demux(_video_stream(container, path))
            return sum(1 for p in packets if p.size > 0 and not p.is_discard and not p.is_corrupt)
        except av.FFmpegError as cause:
            raise TruncatedVideo(f"{path}: damaged ({cause})") from cause


def _require_whole(path: Path, frames: int, promised: int) -> None:
    if frames + MISSING_FRAMES_ALLOWED < promised:
        raise TruncatedVideo(
            f"{path}: holds {frames} of the {promised} frames that its index promises; "
            "copy or download the file again"
        )


def require_within(info: VideoInfo, limits: VideoLimits) -> None:
    """Raise `VideoTooLong` or `TrackTooShort` where a video is outside the limits."""
    if info.duration_s > limits.max_duration_s:
        raise VideoTooLong(
            f"{info.path}: {info.duration_s:.1f} s is longer than the limit of "
            f"{limits.max_duration_s:g} s; trim it or raise max_duration_s"
        )
    if info.frames < limits.min_frames:
        raise TrackTooShort(
            f"{info.path}: {info.frames} frame, at least {limits.min_frames} are needed"
        )
