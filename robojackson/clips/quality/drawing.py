"""Is the dancer drawn? The paper's own example of a bad clip is a cartoon that dances.

A pose detector takes a good drawing for a person. The difference is paint: inside a drawn
body neighbouring pixels are equal, on skin and cloth light, folds and the camera's noise differ.
"""

import cv2
import numpy as np
from jaxtyping import Bool, Float, UInt8
from pydantic import Field

from robojackson.clips.people.camera_motion import spread
from robojackson.clips.people.person_extent import indices
from robojackson.config import config_dataclass

LIMBS = (
    ("shoulder", "elbow"),
    ("elbow", "wrist"),
    ("hip", "knee"),
    ("knee", "ankle"),
)
LIMB_WIDTH = 0.03
"""Body heights: inside the limb, away from its outline."""


@config_dataclass
class DrawingConfig:
    """Configuration of recognising drawings.

    Attributes:
        samples_per_s: Frames that are looked at, a second.
        fewest: Frames that are looked at in a short clip.
        short_side: Pixels of the short side of the pictures that are looked at.
        level: Largest difference of neighbouring pixels of one paint, 0..255.
    """

    samples_per_s: float = Field(default=0.5, gt=0)
    fewest: int = Field(default=3, ge=1)
    short_side: int = Field(default=360, ge=64)
    level: int = Field(default=4, ge=0)


class Paint:
    """Reads every frame of a clip in order and looks at the paint in a few."""

    def __init__(self, frames: int, fps: float, config: DrawingConfig) -> None:
        self._config = config
        self._chosen = spread(frames, fps, config.samples_per_s, config.fewest)
        self._shares: list[float] = []

    def add_frame(self, index: int, image: np.ndarray, xy: Float[np.ndarray, "33 2"]) -> None:
        """Add frame number `index`, RGB, with the landmarks of the person in it."""
        if index in self._chosen and not np.isnan(xy).any():
            factor = min(1.0, self._config.short_side / min(image.shape[:2]))
            small = cv2.resize(image, None, fx=factor, fy=factor, interpolation=cv2.INTER_AREA)
            self._shares.append(flat_share(small, xy, self._config.level))

    @property
    def flat_share(self) -> float:
        """Share of the body in flat colour, median of the frames; 0 without a person."""
        return float(np.median(self._shares)) if self._shares else 0.0


def flat_share(image: UInt8[np.ndarray, "H W 3"], xy: np.ndarray, level: int) -> float:
    """Return the share of the body's pixels whose 3 x 3 neighbours have the same colour."""
    square = np.ones((3, 3), np.uint8)
    apart = cv2.subtract(cv2.dilate(image, square), cv2.erode(image, square)).max(-1)
    inside = apart[body(xy, image.shape[1], image.shape[0])]
    return float((inside <= level).mean()) if inside.size else 0.0


def body(xy: Float[np.ndarray, "33 2"], width: int, height: int) -> Bool[np.ndarray, "H W"]:
    """Return the pixels of trunk and limbs."""
    points = np.round(xy * [width, height]).astype(np.int32)
    mask = np.zeros((height, width), np.uint8)
    trunk = indices(("left_shoulder", "right_shoulder", "left_hip", "right_hip"))
    cv2.fillConvexPoly(mask, cv2.convexHull(points[trunk]), 1)
    thick = max(1, int(LIMB_WIDTH * np.ptp(points[:, 1])))
    for side in ("left", "right"):
        for upper, lower in LIMBS:
            begin, end = points[indices((f"{side}_{upper}", f"{side}_{lower}"))].tolist()
            cv2.line(mask, begin, end, 1, thick)
    return mask.astype(bool)
