"""A range of a video as a file of its own."""

import secrets
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
from av.video.frame import VideoFrame

from robojackson.clips.sound import RATE, Sound, encode_sound, read_sound
from robojackson.clips.video import VideoLimits, probe, timed_frames
from robojackson.errors import TrackTooShort
from robojackson.files.local_folder import TEMPORARY
from robojackson.motion.landmark_track import uneven

ANY = VideoLimits(max_duration_s=None, min_frames=1)
CLOCK = 90_000
"""Ticks a second of a file whose frames are not evenly spaced."""


def trim(path: Path, start_s: float, end_s: float, out: Path) -> Path:
    """Re-encode a range of a video (H.264, upright, same times) with its sound; whole or absent.

    A copy of packets would start at the key frame before `start_s`; a re-encoding starts where it
    was set to.

    Raises:
        TrackTooShort: the range holds no frame.
    """
    info, sound = probe(path, ANY), read_sound(path, start_s)
    written = out.with_name(f"{TEMPORARY}{secrets.token_hex(8)}.mp4")
    try:
        frames = timed_frames(path, start_s, end_s)
        rate = Fraction(info.fps).limit_denominator(1001)
        times = _encode(frames, rate, info.uneven, written, sound, start_s)
        if not times:
            raise TrackTooShort(f"no frame between {start_s:g} s and {end_s:g} s", path)
        if not info.uneven and uneven(np.array(times), info.fps):  # damaged frames are left out
            _encode(timed_frames(path, start_s, end_s), rate, True, written, sound, start_s)
        written.replace(out)
    finally:
        written.unlink(missing_ok=True)
    return out


def _encode(
    frames: Iterator[tuple[float, np.ndarray]],
    rate: Fraction,
    timed: bool,
    out: Path,
    sound: Sound | None,
    sound_start_s: float,
) -> list[float]:
    """Write images as H.264, at their times or at an even rate, with a sound that begins at
    `sound_start_s` and is silent after its end; returns their times since the first of them,
    seconds."""
    times: list[float] = []
    start_s = 0.0
    with av.open(f"file:{out.absolute()}", "w", format="mp4") as container:
        stream = container.add_stream("libx264", rate=rate, options={"crf": "17"})
        stream.pix_fmt = "yuv420p"
        if timed:
            stream.time_base = stream.codec_context.time_base = Fraction(1, CLOCK)
        heard = sound and container.add_stream("aac", rate=RATE, layout="stereo")
        for time_s, image in frames:
            even = image[: image.shape[0] // 2 * 2, : image.shape[1] // 2 * 2]
            if not times:
                stream.height, stream.width = even.shape[:2]
                start_s = time_s
            picture = VideoFrame.from_ndarray(np.ascontiguousarray(even))
            if timed:
                picture.pts, picture.time_base = (
                    round((time_s - start_s) * CLOCK),
                    Fraction(1, CLOCK),
                )
            times.append(time_s - start_s)
            container.mux(stream.encode(picture))
        if times:
            container.mux(stream.encode(None))
        if times and sound and heard:
            first = round((start_s - sound_start_s) * RATE)
            samples = np.zeros((round((times[-1] + 1 / rate) * RATE), 2), np.float32)
            there = sound.samples[first : first + len(samples)]
            samples[: len(there)] = there
            encode_sound(container, heard, Sound(samples))
    return times
