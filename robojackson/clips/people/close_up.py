"""A close look at a person whom the whole picture does not show well, because he is far away.

BlazePose looks for people in 224 pixels of the whole picture: a person of 250 pixels in one of
1920 x 1080 is not found in any frame, in a window around him he is found in all of them down to 60
pixels. So the person is searched for in windows of some frames, first near the last place, then all
over the picture; then the detector follows him inside windows of full resolution that stand still
for as long as he stays in them. Pixels of the upright picture, origin top left.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from jaxtyping import Float, UInt8
from pydantic import Field

from robojackson.clips.people.camera_motion import spread
from robojackson.clips.people.person_detection import detect_person
from robojackson.clips.people.person_extent import place_of, stature, trunk
from robojackson.clips.people.person_windows import (
    Box,
    detect_in_windows,
    in_picture,
    is_whole,
    tiles,
    window,
    windows,
)
from robojackson.clips.pose_detector import still_landmarker
from robojackson.clips.video import VideoInfo, timed_frames
from robojackson.config import config_dataclass

Look = Callable[[np.ndarray], np.ndarray | None]
"""Detects one person in a picture."""
SEARCHER = "lite"
"""Size of the pose model that searches; the person is then followed with a better one."""
PARTS = (1, 2, 4)
LEAST_TILE, SMALLEST_PX = 160, 32
"""Tiles are the short side of the picture over these, but no smaller than so many pixels unless the
picture is; smaller than the second number it is a strip, whose tiles would be thousands."""
ASTRAY = 1.0
"""Body heights; a detection further than this from the expected place is another's."""


@config_dataclass
class CloseUpConfig:
    """Configuration of looking closely.

    Attributes:
        below_share: Clips with a person in a smaller share of their frames are looked at closely.
        samples_per_s: Frames in which the person is searched for, a second.
        fewest: Frames in which the person is searched for in a short clip.
        most_searches: Frames at most that are searched all over.
        visibility: Least mean visibility of the landmarks of a person, 0..1.
        window: Side of a window, body heights.
    """

    below_share: float = Field(default=0.9, ge=0, le=1)
    samples_per_s: float = Field(default=2.0, gt=0)
    fewest: int = Field(default=4, ge=1)
    most_searches: int = Field(default=8, ge=1)
    visibility: float = Field(default=0.5, ge=0, le=1)
    window: float = Field(default=2.5, ge=1.5)


@dataclass(frozen=True)
class Sight:
    """The person in one frame.

    Attributes:
        frame: Its number.
        place: Middle of the trunk, pixels.
        tall: Stature, pixels.
    """

    frame: int
    place: Float[np.ndarray, "2"]
    tall: float


def look_closely(
    path: Path,
    info: VideoInfo,
    size: str,
    rows: Float[np.ndarray, "T 33 7"],
    config: CloseUpConfig,
    progress: Callable[[int, int], None] | None = None,
) -> Float[np.ndarray, "T 33 7"] | None:
    """Return better rows of a person, NaN where he is not visible; None where there are no better.

    Args:
        path: Video file.
        info: What `probe` found in it.
        size: lite, full or heavy.
        rows: What the detector found in the whole pictures.
        config: When and how to look.
        progress: Called with (frames done, frames in all).
    """
    seen = _share(rows)
    if seen >= config.below_share:
        return None
    sights = search(path, info, config)
    if not sights:
        return None
    closer = _followed(path, info, size, sights, len(rows), config.window, progress)
    return closer if _share(closer) > seen else None


def search(path: Path, info: VideoInfo, config: CloseUpConfig) -> list[Sight]:
    """Return the largest person in some frames, evenly spread over the clip."""
    chosen = spread(info.frames, info.fps, config.samples_per_s, config.fewest)
    found: list[Sight] = []
    searches = 0
    with still_landmarker(SEARCHER) as landmarker:
        look = partial(detect_person, landmarker)
        for index, (_, image) in enumerate(timed_frames(path)):
            if index not in chosen:
                continue
            row = None
            if found:
                near = window(found[-1].place, config.window * found[-1].tall, image.shape)
                row = _best(look, image, [near], config.visibility)
            if row is None and searches < config.most_searches:
                searches += 1
                row = _all_over(look, image, config.visibility)
            if row is not None:
                found.append(_sight(index, row, info))
    return found


def _all_over(look: Look, image: np.ndarray, visibility: float) -> np.ndarray | None:
    """Return the largest person in tiles as large as the picture allows, then in smaller ones."""
    height, width = image.shape[:2]
    for side in (min(width, height) // part for part in PARTS):
        if side >= LEAST_TILE or side == min(width, height) >= SMALLEST_PX:
            row = _best(look, image, tiles(width, height, side), visibility)
            if row is not None:
                return row
    return None


def _best(
    look: Look, image: UInt8[np.ndarray, "H W 3"], boxes: list[Box], visibility: float
) -> np.ndarray | None:
    """Return the largest person who is whole in one of some windows; None for no person."""
    height, width = image.shape[:2]
    found = []
    for box in boxes:
        row = look(image[box[1] : box[3], box[0] : box[2]])
        if row is not None and is_whole(row) and row[:, 6].mean() >= visibility:
            found.append(in_picture(row, box, width, height))
    size = (width, height)
    return max(found, key=lambda row: float(stature(row[:, :2] * size)), default=None)


def _sight(index: int, row: np.ndarray, info: VideoInfo) -> Sight:
    return Sight(index, *place_of(row, (info.width, info.height)))


def _followed(
    path: Path,
    info: VideoInfo,
    size: str,
    sights: list[Sight],
    count: int,
    sides: float,
    progress: Callable[[int, int], None] | None,
) -> Float[np.ndarray, "T 33 7"]:
    """Return what the detector finds inside windows around the places between sights."""
    known = [sight.frame for sight in sights]
    points = np.array([sight.place for sight in sights])
    places = np.stack([np.interp(np.arange(count), known, axis) for axis in points.T], -1)
    tall = float(np.median([sight.tall for sight in sights]))
    boxes = windows(places, sides * tall, (info.height, info.width))
    rows = detect_in_windows(path, info, size, boxes, progress=progress)
    found = (rows[:, trunk(), :2] * (info.width, info.height)).mean(1)
    rows[np.linalg.norm(found - places, axis=1) > ASTRAY * tall] = np.nan
    return rows


def _share(rows: Float[np.ndarray, "T 33 7"]) -> float:
    return float((~np.isnan(rows[:, 0, 0])).mean()) if len(rows) else 1.0
