"""Convert a film to an animated picture (GIF or WebP), where no video can be shown."""

import io
import math
from itertools import pairwise
from pathlib import Path

import cv2
from PIL import Image

from robojackson.clips.video import VideoLimits, probe, read_frames
from robojackson.files.file_tree import FileTree

FPS, LONGEST_PX = 12, 640
ROUNDING = 1e-3
"""Error of a file's frame rate over `FPS`, at most: 24.0001 frames a second are 24."""
UNIT_MS = 10
"""Step of a picture's duration in a GIF, milliseconds."""


def write_animation(film: Path, out: Path, kind: str) -> Path:
    """Write the pictures of a film, repeated without end: at most 12 a second, longer side 640
    pixels.

    Args:
        kind: gif or webp.
    Raises:
        UnreadableVideo: the film cannot be read.
        StoreError: the file cannot be written.
    """
    info = probe(film, VideoLimits(max_duration_s=None, min_frames=1))
    every = max(1, math.ceil(info.fps / FPS - ROUNDING))
    scale = min(1.0, LONGEST_PX / max(info.width, info.height))
    pictures = [
        Image.fromarray(cv2.resize(frame, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA))
        for index, frame in enumerate(read_frames(film))
        if index % every == 0
    ]
    duration, made = durations_ms(len(pictures), every / info.fps), io.BytesIO()
    first, rest = pictures[0], pictures[1:]
    first.save(made, kind, save_all=True, append_images=rest, duration=duration, loop=0)
    FileTree(out.parent).write(out.name, made.getvalue())
    return out


def durations_ms(count: int, period_s: float) -> list[int]:
    """Return the duration of each picture in whole units; their sum is off by half a unit at most.

    Args:
        period_s: Time from one picture to the next, seconds.
    """
    ends = [UNIT_MS * round(1000 * period_s * index / UNIT_MS) for index in range(count + 1)]
    return [end - begin for begin, end in pairwise(ends)]
