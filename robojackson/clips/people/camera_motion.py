"""Does the camera stand still? Displacement of the background between two frames, a few a second.

Corners outside the person's box are followed by Lucas-Kanade; the camera moved if most of them did
(the median: a person who walks by is a few corners). Displacements are shares of the image's
diagonal, a frame.
"""

import cv2
import numpy as np
from jaxtyping import Float, UInt8
from pydantic import Field

from robojackson.clips.people.person_extent import box
from robojackson.config import config_dataclass

PERSON_MARGIN = 0.15
FEWEST_CORNERS = 8
USUAL_FPS = 30.0
CORNER_QUALITY, CORNER_DISTANCE = 0.01, 7
LEAST_TEXTURE = 3e-3
"""Share of the best corner; pixels; of Lucas-Kanade: along a plain edge nothing can be followed."""


@config_dataclass
class CameraConfig:
    """Configuration of measuring the camera's motion.

    Attributes:
        samples_per_s: Pairs of frames that are compared, a second.
        fewest: Pairs that are compared in a short clip.
        short_side: Pixels of the short side of the pictures that are compared.
        corners: Most corners that are followed.
        still: Displacement of a camera that stands, image diagonals in a thirtieth of a second.
    """

    samples_per_s: float = Field(default=2.0, gt=0)
    fewest: int = Field(default=8, ge=1)
    short_side: int = Field(default=240, ge=32)
    corners: int = Field(default=120, ge=FEWEST_CORNERS)
    still: float = Field(default=0.003, gt=0)


class CameraMotion:
    """Reads every frame of a clip in order and measures a few."""

    def __init__(self, frames: int, fps: float, config: CameraConfig) -> None:
        self._config = config
        self._still = config.still * USUAL_FPS / fps
        self._chosen = spread(frames - 1, fps, config.samples_per_s, config.fewest)
        self._before: np.ndarray | None = None
        self.displacements: list[float] = []

    def add_frame(self, index: int, image: np.ndarray, xy: Float[np.ndarray, "33 2"]) -> None:
        """Add frame number `index`, RGB, with the landmarks of the person in it."""
        if self._before is not None:
            after = self._small(image)
            self.displacements.append(displacement(self._before, after, xy, self._config.corners))
            self._before = after if index in self._chosen else None
        elif index in self._chosen:
            self._before = self._small(image)

    @property
    def static_share(self) -> float:
        """Share of the pairs between which the camera stood still; 1 where nothing shows it."""
        known = [d for d in self.displacements if not np.isnan(d)]
        return float(np.mean(np.array(known) <= self._still)) if known else 1.0

    def _small(self, image: np.ndarray) -> np.ndarray:
        factor = min(1.0, self._config.short_side / min(image.shape[:2]))
        return cv2.resize(
            grey_levels(image), None, fx=factor, fy=factor, interpolation=cv2.INTER_AREA
        )


def grey_levels(image: UInt8[np.ndarray, "H W *C"]) -> UInt8[np.ndarray, "H W"]:
    """Return the grey levels of a picture that is RGB, or grey already."""
    return image if image.ndim == 2 else np.asarray(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY))


def displacement(
    before: UInt8[np.ndarray, "H W"],
    after: UInt8[np.ndarray, "H W"],
    xy: Float[np.ndarray, "33 2"],
    corners: int,
) -> float:
    """Return how far the background moved, in diagonals; NaN where nothing in it could be
    followed."""
    height, width = before.shape
    mask = np.full_like(before, 255)
    person = box(xy, PERSON_MARGIN, width, height)
    if person:
        x0, y0, x1, y1 = person
        mask[y0:y1, x0:x1] = 0
    points = cv2.goodFeaturesToTrack(before, corners, CORNER_QUALITY, CORNER_DISTANCE, mask=mask)
    if points is None or len(points) < FEWEST_CORNERS:
        return np.nan
    guess = points.copy()
    moved, found, _ = cv2.calcOpticalFlowPyrLK(
        before, after, points, guess, winSize=(21, 21), minEigThreshold=LEAST_TEXTURE
    )
    kept = found.ravel() == 1
    if kept.sum() < FEWEST_CORNERS:
        return np.nan
    steps = np.linalg.norm((moved - points).reshape(-1, 2)[kept], axis=1)
    return float(np.median(steps) / np.hypot(width, height))


def spread(frames: int, fps: float, per_second: float, fewest: int) -> frozenset[int]:
    """Return indices of frames, evenly spread over a clip: `per_second`, and at least `fewest`."""
    count = min(max(round(frames / fps * per_second), fewest), max(frames, 0))
    return frozenset(int((i + 0.5) * frames / count) for i in range(count))
