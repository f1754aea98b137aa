"""Windows around the course of a person who is small in the picture, and the detector inside them.

A window stands still for as long as the person stays in its middle: the detector, which follows
from frame to frame, is begun again with each. Pixels of the upright picture, origin top left.
"""

from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

import numpy as np
from jaxtyping import Float

from robojackson.clips.people.person_extent import BODY, indices
from robojackson.clips.pose_detector import video_landmarker
from robojackson.clips.video import VideoInfo, timed_frames

Box = tuple[int, int, int, int]
"""x0, y0, x1, y1."""
OVERLAP = 0.5
"""Share of a tile that the next one covers too."""
View = Callable[[int, np.ndarray], np.ndarray | None]
"""Returns what the detector is shown of a frame, of the same size; None passes it over."""
STAYS = 0.25
"""Of `windows`, where no others are near."""


def window(place: Float[np.ndarray, "2"], side: float, shape: tuple[int, ...]) -> Box:
    """Return a square window around a place, moved and cut to lie inside a picture."""
    length = np.minimum(round(side), shape[1::-1])
    low = np.clip(np.round(place - length / 2.0), 0, np.array(shape[1::-1]) - length).astype(int)
    high = low + length
    return int(low[0]), int(low[1]), int(high[0]), int(high[1])


def windows(
    places: Float[np.ndarray, "T 2"], side: float, shape: tuple[int, ...], stays: float = STAYS
) -> Iterator[tuple[int, Box]]:
    """Yield windows and the frame at which each ends: when the person is further from its middle
    than `stays`, sides of the window."""
    start = 0
    while start < len(places):
        low = np.minimum.accumulate(places[start:])
        high = np.maximum.accumulate(places[start:])
        leaves = np.atleast_1d(((high - low) / 2.0 > stays * side).any(1))
        end = start + (int(np.argmax(leaves)) if leaves.any() else len(leaves))
        last = end - start - 1
        yield end, window((low[last] + high[last]) / 2.0, side, shape)
        start = end


def tiles(width: int, height: int, side: int) -> list[Box]:
    """Return square windows that cover a picture and overlap by half."""

    def starts(length: int) -> list[int]:
        count = int(np.ceil(max(length - side, 0) / (side * (1.0 - OVERLAP)))) + 1
        return [round(float(start)) for start in np.linspace(0, max(length - side, 0), count)]

    return [
        (x, y, min(x + side, width), min(y + side, height))
        for y in starts(height)
        for x in starts(width)
    ]


def is_whole(row: Float[np.ndarray, "33 7"]) -> bool:
    """Return whether head, trunk and legs are inside the window."""
    points = row[indices(BODY), :2]
    return bool(((points >= 0.0) & (points <= 1.0)).all())


def detect_in_windows(
    path: Path,
    info: VideoInfo,
    size: str,
    boxes: Iterable[tuple[int, Box]],
    view: View | None = None,
    progress: Callable[[int, int], None] | None = None,
    short_side: int | None = None,
) -> Float[np.ndarray, "T 33 7"]:
    """Return the landmarks of the person in each window, NaN where none is found.

    Args:
        path: Video file.
        info: What `probe` found in it.
        size: lite, full or heavy.
        boxes: Windows, and the frame at which each ends.
        view: What the detector is shown; the picture as it is if absent.
        progress: Called with (frames done, frames in all).
        short_side: Short side of the pictures, pixels; that of the video if absent.
    """
    ends = list(boxes)
    count = ends[-1][0] if ends else 0
    rows = np.full((count, 33, 7), np.nan)
    frames = enumerate(timed_frames(path, short_side=short_side))
    for end, box in ends:
        with video_landmarker(size) as detect_frame:
            for index, (time_s, image) in frames:
                shown = image if view is None else view(index, image)
                if shown is not None:
                    found = detect_frame(_inside(shown, box, info), time_s)
                    rows[index] = in_picture(found, box, info.width, info.height)
                if progress:
                    progress(index + 1, count)
                if index + 1 == end:
                    break
    return rows


def in_picture(
    row: Float[np.ndarray, "33 7"], box: Box, width: int, height: int
) -> Float[np.ndarray, "33 7"]:
    """Return landmarks of a window as landmarks of the whole picture; depth is in widths too."""
    size = np.array([box[2] - box[0], box[3] - box[1], box[2] - box[0]])
    moved = np.array(row)
    moved[:, :3] = (row[:, :3] * size + [box[0], box[1], 0]) / [width, height, width]
    return moved


def _inside(image: np.ndarray, box: Box, info: VideoInfo) -> np.ndarray:
    """Return a window of a picture, which may be smaller than the video's."""
    across, down = image.shape[1] / info.width, image.shape[0] / info.height
    x0, x1 = round(box[0] * across), round(box[2] * across)
    return image[round(box[1] * down) : round(box[3] * down), x0:x1]
