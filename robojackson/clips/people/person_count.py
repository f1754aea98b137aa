"""Count the people in a clip. The paper could not separate two dancers.

PoseLandmarker with several poses finds one of two people who stand side by side in every
second frame (measured), so a few frames a second are processed again with found people painted
over, until none is left.
"""

from typing import Any

import cv2
import numpy as np
from jaxtyping import Float
from pydantic import Field

from robojackson.clips.people.camera_motion import spread
from robojackson.clips.people.person_extent import box
from robojackson.config import config_dataclass

PERSON_MARGIN = 0.15


@config_dataclass
class PeopleConfig:
    """Configuration of counting people.

    Attributes:
        samples_per_s: Frames that are looked at, a second.
        fewest: Frames that are looked at in a short clip.
        most: People that are counted at most.
        short_side: Pixels of the short side of the pictures that are looked at.
        smallest: A person below this size is in the background, heights of the first person.
        visibility: Least mean visibility of the landmarks of a person, 0..1.
    """

    samples_per_s: float = Field(default=1.0, gt=0)
    fewest: int = Field(default=4, ge=1)
    most: int = Field(default=4, ge=2)
    short_side: int = Field(default=360, ge=64)
    smallest: float = Field(default=0.4, gt=0)
    visibility: float = Field(default=0.6, ge=0, le=1)


class People:
    """Reads every frame of a clip in order and counts the people in a few."""

    def __init__(self, frames: int, fps: float, landmarker: Any, config: PeopleConfig) -> None:
        self._config, self._landmarker = config, landmarker
        self._chosen = spread(frames, fps, config.samples_per_s, config.fewest)
        self.counts: list[int] = []

    def add_frame(self, index: int, image: np.ndarray, xy: Float[np.ndarray, "33 2"]) -> None:
        """Add frame number `index`, RGB, with the landmarks of the person in it."""
        if index in self._chosen:
            self.counts.append(self._count(image, xy))

    @property
    def typical(self) -> int:
        """Number of people visible in at least a third of the examined frames."""
        most_first = sorted(self.counts, reverse=True)
        return most_first[-(-len(most_first) // 3) - 1] if most_first else 0

    def _count(self, image: np.ndarray, xy: np.ndarray) -> int:
        factor = min(1.0, self._config.short_side / min(image.shape[:2]))
        small = cv2.resize(image, None, fx=factor, fy=factor, interpolation=cv2.INTER_LINEAR)
        height, width = small.shape[:2]
        first = box(xy, 0.0, width, height)
        if first is None:
            return 0
        tall = max(first[3] - first[1], 1)
        found = 1
        while found < self._config.most:
            _paint_over(small, xy)
            other = self._look(small)
            if other is None or np.ptp(other[:, 1]) * height < self._config.smallest * tall:
                break
            xy = other[:, :2]
            found += 1
        return found

    def _look(self, small: np.ndarray) -> np.ndarray | None:
        """Return landmarks of a person who is still in the picture, columns x, y, visibility."""
        import mediapipe

        picture = mediapipe.Image(image_format=mediapipe.ImageFormat.SRGB, data=small)
        people = self._landmarker.detect(picture).pose_landmarks
        if not people:
            return None
        rows = np.array([[p.x, p.y, p.visibility] for p in people[0]])
        return rows if rows[:, 2].mean() >= self._config.visibility else None


def _paint_over(image: np.ndarray, xy: np.ndarray) -> None:
    """Fill the box of a person with the mean colour of the picture."""
    person = box(xy, PERSON_MARGIN, image.shape[1], image.shape[0])
    if person:
        x0, y0, x1, y1 = person
        image[y0:y1, x0:x1] = image.reshape(-1, 3).mean(0)
