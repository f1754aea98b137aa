"""All people in one picture. BlazePose finds one person well and a second one badly.

With several poses, PoseLandmarker misses one of two people who stand side by side in every
second frame, and in most after they crossed (measured): its detector throws away circles that
overlap. So each found person is painted over, limb by limb, and the detector runs again until
none is left: 94-99 % of two dancers who cross.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from jaxtyping import UInt8
from pydantic import Field

from robojackson.clips.people.person_extent import place_of
from robojackson.clips.people.person_silhouette import mean_colours, paint, silhouette
from robojackson.clips.people.person_windows import Box, in_picture, is_whole, tiles, window
from robojackson.clips.pose_detector import first_person
from robojackson.config import config_dataclass


@config_dataclass
class PersonDetectionConfig:
    """Configuration of detecting all people in a picture.

    Attributes:
        most: People that are looked for in a picture.
        limb_width: Width of the paint over a limb, body heights.
        short_side: Pixels of the short side of the pictures that are looked at.
        visibility: Least mean visibility of the landmarks of a person, 0..1.
        smallest: A person below this size is in the background, heights of the largest.
        window: Side of the window in which a person is looked for who was there before, body
            heights.
        tile: Side of the windows all over the picture, of its short side, 0..1.
        far_below: Windows all over the picture are looked at where no person is taller than this,
            of its short side, 0..1.
        search_every_s: Seconds between two frames that are searched all over.
        memory_s: How long a person who is not found is looked for, seconds.
        apart: Two finds with their trunks nearer than this are one person, body heights.
    """

    most: int = Field(default=5, ge=2)
    limb_width: float = Field(default=0.07, gt=0)
    short_side: int = Field(default=720, ge=64)
    visibility: float = Field(default=0.5, ge=0, le=1)
    smallest: float = Field(default=0.25, gt=0)
    window: float = Field(default=2.0, ge=1.5)
    tile: float = Field(default=0.4, gt=0, le=1)
    far_below: float = Field(default=0.5, ge=0, le=1)
    search_every_s: float = Field(default=1.0, gt=0)
    memory_s: float = Field(default=1.0, ge=0)
    apart: float = Field(default=0.12, gt=0)


@dataclass(frozen=True)
class PersonDetection:
    """One person in one frame.

    Attributes:
        row: Image xyz, world xyz, visibility of the landmarks.
        colours: Mean CIELAB colour of trunk and of thighs, 0..255, NaN where hidden.
    """

    row: np.ndarray
    colours: np.ndarray


def detect_people(
    image: UInt8[np.ndarray, "H W 3"],
    landmarker: Any,
    config: PersonDetectionConfig,
    expected: Sequence[np.ndarray] = (),
    everywhere: bool = False,
) -> list[PersonDetection]:
    """Return all people in a picture, in the detector's order.

    Args:
        image: RGB.
        landmarker: For single pictures.
        config: How to look.
        expected: Rows of people who were there shortly before: who is not found in the whole
            picture is looked for in a window there.
        everywhere: Whether to look in windows all over the picture, too.
    """
    factor = min(1.0, config.short_side / min(image.shape[:2]))
    small = cv2.resize(image, None, fx=factor, fy=factor, interpolation=cv2.INTER_AREA)
    crowd = _Crowd(small, config)
    for _ in range(config.most):
        if not crowd.add(detect_person(landmarker, small)):
            break
    height, width = small.shape[:2]
    boxes = [_around(row, config.window, small.shape) for row in expected if crowd.lacks(row)]
    tallest = max(crowd.statures(), default=0.0)
    if everywhere and tallest < config.far_below * min(width, height):
        boxes += tiles(width, height, round(config.tile * min(width, height)))
    for x0, y0, x1, y1 in boxes:
        row = detect_person(landmarker, small[y0:y1, x0:x1])
        if row is not None and is_whole(row) and len(crowd.found) < config.most:
            crowd.add(in_picture(row, (x0, y0, x1, y1), width, height))
    limit = config.smallest * max(crowd.statures(), default=0.0)
    tall_enough = [height >= limit for height in crowd.statures()]
    return [person for person, kept in zip(crowd.found, tall_enough, strict=True) if kept]


class _Crowd:
    """People who were found in a picture, and the picture with them painted over."""

    def __init__(self, image: np.ndarray, config: PersonDetectionConfig) -> None:
        self.found: list[PersonDetection] = []
        self._image, self._config = image, config
        self._painted = np.zeros(image.shape[:2], bool)

    def add(self, row: np.ndarray | None) -> bool:
        """Paint a find over, and keep it unless it is known; return whether it is a person."""
        if row is None or row[:, 6].mean() < self._config.visibility:
            return False
        if self.lacks(row):
            colours = mean_colours(self._image, row[:, :2], self._painted)
            self.found.append(PersonDetection(row, colours))
        height, width = self._image.shape[:2]
        mask = silhouette(row[:, :2], width, height, self._config.limb_width)
        paint(self._image, mask)
        self._painted |= mask
        return True

    def statures(self) -> list[float]:
        """Return the height of each, pixels."""
        size = self._image.shape[1::-1]
        return [place_of(person.row, size)[1] for person in self.found]

    def lacks(self, row: np.ndarray) -> bool:
        """Return whether none of those found is where this row is."""
        shape, apart = self._image.shape, self._config.apart
        return not any(_same(row, other.row, shape, apart) for other in self.found)


def _around(row: np.ndarray, side: float, shape: tuple[int, ...]) -> Box:
    """Return a window of `side` body heights around a person."""
    place, tall = place_of(row, shape[1::-1])
    return window(place, side * tall, shape)


def detect_person(landmarker: Any, image: np.ndarray) -> np.ndarray | None:
    """Return one person in a single picture, (33, 7); None without one."""
    import mediapipe

    rows = np.ascontiguousarray(image)
    picture = mediapipe.Image(image_format=mediapipe.ImageFormat.SRGB, data=rows)
    return first_person(landmarker.detect(picture))


def _same(a: np.ndarray, b: np.ndarray, shape: tuple[int, ...], apart: float) -> bool:
    (first, tall), (second, taller) = (place_of(row, shape[1::-1]) for row in (a, b))
    return bool(np.linalg.norm(first - second) < apart * max(tall, taller))
