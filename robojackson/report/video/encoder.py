"""Writing pictures as a video that browsers play: H.264, or MPEG-4 where FFmpeg has no x264."""

import secrets
from collections.abc import Iterable
from fractions import Fraction
from pathlib import Path
from typing import cast

import av
from av.video.frame import VideoFrame
from av.video.stream import VideoStream

from robojackson.files.local_folder import TEMPORARY
from robojackson.report.video.canvas import Picture

CODECS = ("libx264", "mpeg4")


def write_video(pictures: Iterable[Picture], fps: int, out: Path, quality: int = 20) -> Path:
    """Encode RGB pictures of one even size; `out` is whole or absent.

    Args:
        quality: Constant rate factor; lower is better and larger.
    """
    partial = out.with_name(f"{TEMPORARY}{secrets.token_hex(8)}.mp4")
    try:
        _encode(pictures, fps, partial, quality)
        partial.replace(out)
    finally:
        partial.unlink(missing_ok=True)
    return out


def _encode(pictures: Iterable[Picture], fps: int, out: Path, quality: int) -> None:
    codec = next(name for name in CODECS if name in av.codecs_available)
    with av.open(
        f"file:{out.absolute()}", "w", format="mp4", options={"movflags": "+faststart"}
    ) as container:
        options = {"crf": str(quality), "preset": "veryfast"} if codec == "libx264" else {}
        stream = cast(VideoStream, container.add_stream(codec, rate=Fraction(fps), options=options))
        stream.pix_fmt = "yuv420p"
        for index, picture in enumerate(pictures):
            if index == 0:
                stream.height, stream.width = picture.shape[:2]
            container.mux(stream.encode(VideoFrame.from_ndarray(picture, format="rgb24")))
        container.mux(stream.encode(None))
