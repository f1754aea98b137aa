"""Encode pictures as a video that browsers play: H.264, or MPEG-4 where FFmpeg has no x264."""

import secrets
from collections.abc import Iterable
from fractions import Fraction
from pathlib import Path
from typing import cast

import av
from av.video.frame import VideoFrame
from av.video.stream import VideoStream

from robojackson.clips.sound import RATE, Sound, encode_sound
from robojackson.files.local_folder import TEMPORARY
from robojackson.report.video.canvas import Picture

CODECS = ("libx264", "mpeg4")


def write_video(
    pictures: Iterable[Picture],
    fps: int,
    out: Path,
    quality: int = 20,
    sound: Sound | None = None,
    seekable: bool = False,
) -> Path:
    """Encode RGB pictures of one even size; `out` is whole or absent.

    Args:
        quality: Constant rate factor; lower is better and larger.
        sound: Sound from the first picture on.
        seekable: Whether any picture can be found fast, in a larger file.
    """
    partial = out.with_name(f"{TEMPORARY}{secrets.token_hex(8)}.mp4")
    try:
        _encode(pictures, fps, partial, quality, sound, seekable)
        partial.replace(out)
    finally:
        partial.unlink(missing_ok=True)
    return out


def _encode(
    pictures: Iterable[Picture],
    fps: int,
    out: Path,
    quality: int,
    sound: Sound | None,
    seekable: bool,
) -> None:
    codec = next(name for name in CODECS if name in av.codecs_available)
    with av.open(
        f"file:{out.absolute()}", "w", format="mp4", options={"movflags": "+faststart"}
    ) as container:
        options = {"crf": str(quality), "preset": "veryfast"} if codec == "libx264" else {}
        if seekable:
            options |= {"g": str(max(1, fps // 2)), "bf": "0"}
        stream = cast(VideoStream, container.add_stream(codec, rate=Fraction(fps), options=options))
        stream.pix_fmt = "yuv420p"
        heard = sound and container.add_stream("aac", rate=RATE, layout="stereo")
        for index, picture in enumerate(pictures):
            if index == 0:
                stream.height, stream.width = picture.shape[:2]
            container.mux(stream.encode(VideoFrame.from_ndarray(picture, format="rgb24")))
        container.mux(stream.encode(None))
        if sound and heard:
            encode_sound(container, heard, sound)
