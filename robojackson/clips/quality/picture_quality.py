"""Brightness and sharpness of a person in a clip, measured on a few frames."""

from collections.abc import Iterable, Iterator

import cv2
import numpy as np
from jaxtyping import Float, UInt8

from robojackson.clips.people.person_extent import box

SAMPLES = 16
"""Pictures that are looked at."""
MARGIN = 0.05
"""Around the person, sizes of his box."""
TALL = 192
"""Pixels to which the person is scaled, so that sharpness does not depend on his size."""
LEAST_PX = 24
"""Of a box that shows anything."""


class PictureQuality:
    """Looks at some of the pictures of a clip as they pass by.

    Args:
        landmarks: Landmarks of the person in every frame, 0..1, NaN where no person was detected.
    """

    def __init__(self, landmarks: Float[np.ndarray, "T 33 2"]) -> None:
        seen = np.flatnonzero(np.isfinite(landmarks).all((1, 2)))
        chosen = np.linspace(0, len(seen) - 1, min(SAMPLES, len(seen))).round().astype(int)
        self._landmarks, self._chosen = landmarks, set(seen[chosen].tolist())
        self._light: list[float] = []
        self._sharp: list[float] = []

    def watch(
        self, images: Iterable[UInt8[np.ndarray, "H W 3"]]
    ) -> Iterator[UInt8[np.ndarray, "H W 3"]]:
        """Yield the same pictures, RGB, one a frame."""
        for index, image in enumerate(images):
            if index in self._chosen:
                self._look(image, self._landmarks[index])
            yield image

    @property
    def brightness(self) -> float | None:
        """Mean grey level of the person's box, 0..1, median of the pictures; None for none."""
        return float(np.median(self._light)) if self._light else None

    @property
    def sharpness(self) -> float | None:
        """Share of the contrast that is fine detail, `detail_share`; None for none."""
        return float(np.median(self._sharp)) if self._sharp else None

    def _look(self, image: np.ndarray, xy: np.ndarray) -> None:
        found = box(xy, MARGIN, image.shape[1], image.shape[0])
        if found is None or min(found[2] - found[0], found[3] - found[1]) < LEAST_PX:
            return
        grey = cv2.cvtColor(image[found[1] : found[3], found[0] : found[2]], cv2.COLOR_RGB2GRAY)
        self._light.append(float(grey.mean()) / 255.0)
        self._sharp.append(detail_share(grey))


def detail_share(grey: UInt8[np.ndarray, "H W"]) -> float:
    """Return the standard deviation of the Laplacian over that of the grey levels, at one size."""
    factor = TALL / grey.shape[0]
    way = cv2.INTER_AREA if factor < 1.0 else cv2.INTER_CUBIC
    width = max(round(grey.shape[1] * factor), 3)
    even = cv2.resize(grey, (width, TALL), interpolation=way).astype(np.float32)
    return float(cv2.Laplacian(even, cv2.CV_32F).std() / max(float(even.std()), 1.0))
