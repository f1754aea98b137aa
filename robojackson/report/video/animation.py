"""Convert a film to an animated picture (GIF or WebP), where no video can be shown."""

import io
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

import cv2
from PIL import Image

from robojackson.clips.video import VideoLimits, probe, timed_frames
from robojackson.files.file_tree import FileTree

FPS, LONGEST_PX = 12, 640
ROUNDING = 1e-3
"""Share of a period that a picture may come early: 24.0001 frames a second are 24."""
UNIT_MS = 10
"""Step of a picture's duration in a GIF, milliseconds."""
LONGEST_MS = 65_535 * UNIT_MS
"""Longest duration of a picture in a GIF."""


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
    scale = min(1.0, LONGEST_PX / max(info.width, info.height))
    pictures: list[Image.Image] = []
    moments: list[float] = []
    for index, (shown_s, frame) in enumerate(timed_frames(film)):
        time_s = shown_s if info.uneven else index / info.fps
        if moments and time_s - moments[-1] < (1.0 - ROUNDING) / FPS:
            continue
        small = cv2.resize(frame, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
        pictures.append(Image.fromarray(small))
        moments.append(time_s)
    duration, made = durations_ms([*moments, info.duration_s]), io.BytesIO()
    first, rest = pictures[0], pictures[1:]
    first.save(made, kind, save_all=True, append_images=rest, duration=duration, loop=0)
    FileTree(out.parent).write(out.name, made.getvalue())
    return out


def durations_ms(moments: Sequence[float]) -> list[int]:
    """Return the duration of each picture in whole units; their sum is off by half a unit at most.

    Args:
        moments: When each picture is shown, and the end of the last one, seconds.
    """
    ends = [UNIT_MS * round(1000 * moment / UNIT_MS) for moment in moments]
    return [min(end - begin, LONGEST_MS) for begin, end in pairwise(ends)]
