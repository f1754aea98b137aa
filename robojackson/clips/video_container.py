"""Video containers, opened with one clear error, and what their packets hold without decoding."""

from pathlib import Path

import av
import numpy as np
from av.video.frame import VideoFrame
from av.video.stream import VideoStream
from jaxtyping import Float

from robojackson.errors import TruncatedVideo, UnreadableVideo

ISO_MEDIA_MARK = b"ftyp"
RATE_TOLERANCE = 0.002
"""A declared rate that differs from the timestamps by more is ignored."""


def opened(path: Path) -> av.container.InputContainer:
    """Return an open container.

    Raises:
        UnreadableVideo: missing, empty, or not a video.
        TruncatedVideo: the file ends before its index.
    """
    if path.is_dir():
        raise UnreadableVideo("a folder, expected one video", path)
    if not path.is_file():
        raise UnreadableVideo("no such file", path)
    if path.stat().st_size == 0:
        raise UnreadableVideo("the file is empty (0 bytes)", path)
    try:
        return av.open(str(path))
    except av.FFmpegError as cause:
        with path.open("rb") as file:
            is_media = ISO_MEDIA_MARK in file.read(32)
        if is_media:
            message = "cut off before its index; copy or download the file again"
            raise TruncatedVideo(message, path) from cause
        raise UnreadableVideo("not a video that FFmpeg can read", path) from cause


def video_stream(container: av.container.InputContainer, path: Path) -> VideoStream:
    """Return the first video stream of a container."""
    if not container.streams.video:
        raise UnreadableVideo("the file holds no video stream", path)
    return container.streams.video[0]


def first_frame(container: av.container.InputContainer, path: Path) -> VideoFrame:
    """Return the first frame that can be decoded."""
    try:
        return next(iter(container.decode(video=0)))
    except (StopIteration, av.FFmpegError) as cause:
        raise UnreadableVideo("the file holds no frame that can be decoded", path) from cause


def packet_times(path: Path) -> Float[np.ndarray, " T"]:
    """Return when each frame is shown, seconds since the first, in order, without decoding.

    Raises:
        TruncatedVideo: the file cannot be read to its end.
    """
    with opened(path) as container:
        stream = video_stream(container, path)
        try:
            found = [
                np.nan if packet.pts is None else float(packet.pts * packet.time_base)
                for packet in container.demux(stream)
                if packet.size > 0 and not packet.is_discard and not packet.is_corrupt
            ]
        except av.FFmpegError as cause:
            raise TruncatedVideo(f"damaged ({cause})", path) from cause
    stamps = np.sort(np.array(found))
    return stamps - stamps[:1] if len(stamps) else stamps


def declared_rate(stream: VideoStream) -> float:
    """Return the frames a second that the file declares; 0 where it declares none."""
    return float(stream.average_rate or stream.guessed_rate or 0)


def rate(stamps: np.ndarray, stated: float) -> float:
    """Return frames a second: the declared rate, unless the timestamps contradict it."""
    span_s = stamps[-1] if len(stamps) > 1 else 0.0
    if not span_s > 0.0:
        return stated
    measured = float((len(stamps) - 1) / span_s)
    return stated if abs(stated / measured - 1.0) <= RATE_TOLERANCE else measured
