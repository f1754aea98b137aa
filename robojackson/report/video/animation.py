"""Convert a film to an animated picture (GIF or WebP), where no video can be shown."""

import io
from pathlib import Path

import cv2
from PIL import Image

from robojackson.clips.video import VideoLimits, probe, read_frames
from robojackson.files.file_tree import FileTree

FPS, LONGEST_PX = 12, 640


def write_animation(film: Path, out: Path, kind: str) -> Path:
    """Write the pictures of a film, repeated without end: at most 12 a second, longer side 640
    pixels.

    Args:
        kind: gif or webp.
    Raises:
        UnreadableVideo: the film cannot be read.
        StoreError: the file cannot be written.
    """
    info = probe(film, VideoLimits(min_frames=1))
    every = max(1, round(info.fps / FPS))
    scale = min(1.0, LONGEST_PX / max(info.width, info.height))
    pictures = [
        Image.fromarray(cv2.resize(frame, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA))
        for index, frame in enumerate(read_frames(film))
        if index % every == 0
    ]
    duration, made = round(1000 * every / info.fps), io.BytesIO()
    first, rest = pictures[0], pictures[1:]
    first.save(made, kind, save_all=True, append_images=rest, duration=duration, loop=0)
    FileTree(out.parent).write(out.name, made.getvalue())
    return out
