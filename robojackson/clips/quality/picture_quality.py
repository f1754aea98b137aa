"""Brightness and sharpness of a person in a clip, measured on a few frames."""

import cv2
import numpy as np
from jaxtyping import Float, UInt8

from robojackson.clips.people.camera_motion import grey_levels
from robojackson.clips.people.person_extent import box

SAMPLES = 16
"""Pictures that are looked at, and up to twice as many."""
MARGIN = 0.05
"""Around the person, sizes of his box."""
TALL = 192
"""Pixels to which the person is scaled, so that sharpness does not depend on his size."""
LEAST_PX = 24
"""Of a box that shows anything."""


class PictureQuality:
    """Measures some of the pictures of a clip as they pass by, evenly spread however long it is."""

    def __init__(self) -> None:
        self._looks: list[tuple[float, float]] = []
        self._step, self._seen = 1, 0

    def add_frame(self, image: UInt8[np.ndarray, "H W *C"], xy: Float[np.ndarray, "33 2"]) -> None:
        """Add the next picture, RGB or grey, and the person in it, 0..1, NaN for no person."""
        if not np.isfinite(xy).all():
            return
        if self._seen % self._step == 0:
            self._look(image, xy)
        self._seen += 1
        if len(self._looks) >= 2 * SAMPLES:
            self._looks, self._step = self._looks[::2], 2 * self._step

    @property
    def brightness(self) -> float | None:
        """Mean grey level of the person's box, 0..1, median of the pictures; None for none."""
        return float(np.median([light for light, _ in self._looks])) if self._looks else None

    @property
    def sharpness(self) -> float | None:
        """Share of the contrast that is fine detail, `detail_share`; None for none."""
        return float(np.median([sharp for _, sharp in self._looks])) if self._looks else None

    def _look(self, image: np.ndarray, xy: np.ndarray) -> None:
        found = box(xy, MARGIN, image.shape[1], image.shape[0])
        if found is None or min(found[2] - found[0], found[3] - found[1]) < LEAST_PX:
            return
        grey = grey_levels(image[found[1] : found[3], found[0] : found[2]])
        self._looks.append((float(grey.mean()) / 255.0, detail_share(grey)))


def detail_share(grey: UInt8[np.ndarray, "H W"]) -> float:
    """Return the standard deviation of the Laplacian over that of the grey levels, at one size."""
    factor = TALL / grey.shape[0]
    way = cv2.INTER_AREA if factor < 1.0 else cv2.INTER_CUBIC
    width = max(round(grey.shape[1] * factor), 3)
    even = cv2.resize(grey, (width, TALL), interpolation=way).astype(np.float32)
    return float(cv2.Laplacian(even, cv2.CV_32F).std() / max(float(even.std()), 1.0))
