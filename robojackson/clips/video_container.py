"""The door for videos: containers opened with one clear error, and what their packets say.

FFmpeg gets an absolute path with the protocol `file` and may open nothing else, so that neither a
colon in a name nor a playlist leads it to the network or to another file. Only the containers of
`CONTAINERS` are read; a picture may have `MOST_PIXELS`, a stream `MOST_FRAMES` frames at no more
than `FASTEST` a second, of which about `ANALYSED` are read.
"""

from collections.abc import Iterable, Iterator
from itertools import islice
from pathlib import Path
from typing import TypeAlias

import av
import numpy as np
from av.video.frame import VideoFrame
from av.video.stream import VideoStream
from jaxtyping import Float

from robojackson.errors import TruncatedVideo, UnreadableVideo
from robojackson.files.file_kinds import TABLE, kind_of

Packet: TypeAlias = "av.Packet[VideoStream]"

ISO_MEDIA_MARK = b"ftyp"
CONTAINERS = (
    *("mov", "matroska", "webm", "avi", "gif", "mpegts", "mpeg", "flv", "asf", "ogg", "nut"),
    *("h264", "hevc", "m4v", "mpegvideo", "mjpeg", "ivf", "obu", "apng", "yuv4mpegpipe"),
)
"""FFmpeg's names; none of them opens another file."""
SOUNDS = ("wav", "mp3", "flac", "aac", "aiff", "w64", "caf")
"""The same of music alone."""
LISTS = {
    b"#EXTM3U": "an HLS playlist",
    b"ffconcat": "a script of FFmpeg's concat",
    b"<MPD": "a DASH manifest",
    b"[playlist]": "a playlist",
    b"v=0": "a session description (SDP)",
}
"""Beginnings of what is no video and names other files."""
TRANSPORT_STREAM = "mpegts"
"""Container of the pieces of a stream of the web; where two are joined, FFmpeg reports damage."""
CLOCK_TOLERANCE_S = 0.5
"""Farther back no clock of a transport stream goes, except where it starts again."""
MOST_PIXELS = 8192 * 8192
ASPECTS = 0.25, 4.0
"""Aspects of pixels that are believed."""
MOST_FRAMES = 500_000
"""More than an hour at 120 frames a second."""
FASTEST = 1000.0
"""Frames a second."""
ANALYSED = 60.0
"""Frames a second that are read, about: of a faster file every second frame, or third, or so on."""
RATE_TOLERANCE = 0.002
"""A declared rate that differs from the timestamps by more is ignored."""
MISSING_FRAMES_ALLOWED = 2
"""Frames that an index may promise beyond those in the file: some writers count one too many."""
PAUSE_S, PAUSE = 0.5, 2.5
"""Two pictures further apart than both, seconds and usual steps, have a pause between them."""


def opened(path: Path, sounds: bool = False) -> av.container.InputContainer:
    """Return an open container.

    Args:
        sounds: Whether files of music alone are read as well.
    Raises:
        UnreadableVideo: missing, empty, or not a video.
        TruncatedVideo: the file ends before its index.
    """
    require_file(path)
    formats = ",".join((*CONTAINERS, *SOUNDS) if sounds else CONTAINERS)
    whitelists = {"protocol_whitelist": "file", "format_whitelist": formats}
    try:
        return av.open(f"file:{path.absolute()}", container_options=whitelists)
    except (av.FFmpegError, UnicodeError) as cause:
        with path.open("rb") as file:
            head = file.read(256)
        if ISO_MEDIA_MARK in head[:32]:
            message = "cut off before its index; copy or download the file again"
            raise TruncatedVideo(message, path) from cause
        raise UnreadableVideo(_unreadable(head, sounds), path) from cause


def require_file(path: Path) -> None:
    """Raise `UnreadableVideo` where there is no file that could be a video."""
    if path.is_dir():
        raise UnreadableVideo("a folder, expected one video", path)
    if path.parts[:1] in (("http:",), ("https:",)):
        raise UnreadableVideo("an address, expected a file; `robojackson dance` downloads", path)
    if not path.is_file():
        kind = "neither a file nor a folder" if path.exists() else "no such file"
        raise UnreadableVideo(kind, path)
    if path.stat().st_size == 0:
        raise UnreadableVideo("the file is empty (0 bytes)", path)


def _unreadable(head: bytes, sounds: bool) -> str:
    text = head.removeprefix(b"\xef\xbb\xbf").lstrip()
    for start, kind in LISTS.items():
        if text.startswith(start) or (start in text and text.startswith(b"<?xml")):
            return f"{kind}, which names other files; give the video itself"
    if kind := kind_of(head):
        goes_on = "; `robojackson retarget` goes on from a motion" if kind == TABLE else ""
        return f"{kind}, not a video{goes_on}"
    return f"not a video {'or sound ' if sounds else ''}that FFmpeg can read"


def video_stream(container: av.container.InputContainer, path: Path) -> VideoStream:
    """Return the first video stream of a container; no picture beyond `MOST_PIXELS`."""
    if not container.streams.video:
        raise UnreadableVideo("the file holds no video stream", path)
    stream = container.streams.video[0]
    if stream.width * stream.height > MOST_PIXELS:
        raise UnreadableVideo(
            f"{stream.width} x {stream.height} pixels; at most {MOST_PIXELS:,} are read: make it "
            "smaller (ffmpeg -i IN -vf scale=-2:1080 OUT.mp4)",
            path,
        )
    stream.codec_context.options = {"max_pixels": str(MOST_PIXELS)}
    return stream


def pixel_aspect(stream: VideoStream) -> float:
    """Return the width of a stored pixel over its height: 1 of nearly all videos, not of anamorphic
    ones (DV, HDV, DVD); 1 where it is not declared or not between `ASPECTS`."""
    declared = float(stream.sample_aspect_ratio or 1)
    return declared if ASPECTS[0] <= declared <= ASPECTS[1] else 1.0


def first_frame(container: av.container.InputContainer, path: Path) -> VideoFrame:
    """Return the first frame that can be decoded."""
    packets = container.demux(video_stream(container, path))
    while True:
        try:
            packet = next(packets, None)
            frames = packet.decode() if packet is not None else []
        except av.FFmpegError:
            continue
        if packet is None:
            raise UnreadableVideo("the file holds no frame that can be decoded", path)
        if frames:
            return frames[0]


def packet_times(path: Path) -> Float[np.ndarray, " T"]:
    """Return when each frame is shown, seconds since the first, in order, without decoding.

    Raises:
        TruncatedVideo: the file cannot be read to its end.
        UnreadableVideo: there are too many frames, or the clock starts again.
    """
    with opened(path) as container:
        stream = video_stream(container, path)
        joined = container.format.name == TRANSPORT_STREAM
        packets = container.demux(stream)
        shown = (
            np.nan if packet.pts is None else float(packet.pts * packet.time_base)
            for packet in (_on_one_clock(packets, path) if joined else packets)
            if packet.size > 0 and not packet.is_discard and (joined or not packet.is_corrupt)
        )
        try:
            found = list(islice(shown, MOST_FRAMES + 1))
        except av.FFmpegError as cause:
            raise TruncatedVideo(f"damaged ({cause})", path) from cause
    if len(found) > MOST_FRAMES:
        raise UnreadableVideo(f"more than {MOST_FRAMES:,} frames; trim it", path)
    stamps = np.sort(np.array(found))
    return stamps - stamps[:1] if len(stamps) else stamps


def require_complete(path: Path, frames: int, promised: int) -> None:
    """Raise `TruncatedVideo` where a file holds fewer frames than its index promises."""
    if frames + MISSING_FRAMES_ALLOWED < promised:
        raise TruncatedVideo(
            f"holds {frames} of the {promised} frames that its index promises; "
            "copy or download the file again",
            path,
        )


def _on_one_clock(packets: Iterable[Packet], path: Path) -> Iterator[Packet]:
    """Yield packets; raise `UnreadableVideo` where their clock starts again."""
    last_s = -np.inf
    for packet in packets:
        if packet.dts is not None:
            now_s = float(packet.dts * packet.time_base)
            if now_s < last_s - CLOCK_TOLERANCE_S:
                raise UnreadableVideo(
                    f"its clock starts again after {last_s:.1f} s: several videos in one file; "
                    "write it again (ffmpeg -i IN OUT.mp4)",
                    path,
                )
            last_s = now_s
        yield packet


def declared_rate(stream: VideoStream) -> float:
    """Return the frames a second that the file declares; 0 where it declares none."""
    return float(stream.average_rate or stream.guessed_rate or 0)


def rate(stamps: np.ndarray, stated: float) -> float:
    """Return frames a second: the declared rate, unless the timestamps contradict it.

    Their mean step counts, without pauses: a camera that waits does not thin the rest.
    """
    span_s = stamps[-1] if len(stamps) > 1 else 0.0
    if not span_s > 0.0:
        return stated
    steps = np.diff(stamps)
    pauses = steps[steps > max(PAUSE_S, PAUSE * float(np.median(steps)))]
    if span_s - pauses.sum() <= 0.0:
        pauses = pauses[:0]
    measured = float((len(steps) - len(pauses)) / (span_s - pauses.sum()))
    return stated if abs(stated / measured - 1.0) <= RATE_TOLERANCE else measured


def length_s(stamps: np.ndarray, fps: float, path: Path) -> float:
    """Return the seconds from the first frame to the end of the last, which are not evenly spaced.

    Raises:
        UnreadableVideo: it pauses for so long that its motion would have too many frames.
    """
    seconds = float(stamps[-1]) + 1.0 / fps
    if seconds * fps > MOST_FRAMES:
        raise UnreadableVideo(
            f"{len(stamps)} frames in {seconds:.0f} s: its motion at {fps:.4g} a second would have "
            f"more than {MOST_FRAMES:,}; write the part without pauses alone (ffmpeg -ss START "
            "-i IN -t SECONDS OUT.mp4)",
            path,
        )
    return seconds


def frame_step(fps: float) -> int:
    """Return n where every n-th frame of a file is read: 1 below 90 frames a second, 2 of 120, 4 of
    240. A dance needs no more, and time and memory grow with the frames."""
    return max(1, round(fps / ANALYSED))
