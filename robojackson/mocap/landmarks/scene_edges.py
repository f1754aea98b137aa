"""Straight edges of the scene, from a few pictures of a clip.

Where the camera stands, the median of the pictures shows the scene without a person that moves;
where it moves, the first picture is taken, in whose frame the landmarks are.
"""

import cv2
import numpy as np
from jaxtyping import Float, UInt8

PICTURES = 5
SHORT_SIDE = 480
"""Short side of the pictures in which edges are sought, pixels."""
LEAST_LENGTH, MOST = 0.03, 300
"""Length of an edge, image diagonals; number of edges, the longest first."""
OVERLAY_TILT, OVERLAY_LENGTH = np.radians(0.1), 0.4
"""An edge along a row or a column of pixels, as long as this share of a side, is drawn onto the
picture: the border of a frame around it."""
PLAIN = 2.0
"""Standard deviation of the grey levels of a row or a column that belongs to a bar at the border,
of 255."""


class SceneEdges:
    """Collects pictures of a clip whose length is not known before."""

    def __init__(self) -> None:
        self._kept: list[np.ndarray] = []
        self._stride = 1

    def add_frame(self, index: int, grey: UInt8[np.ndarray, "H W"]) -> None:
        """Add frame number `index`; few of them are kept, evenly spread."""
        if index % self._stride == 0 and len(self._kept) == 2 * PICTURES:
            self._kept, self._stride = self._kept[::2], 2 * self._stride
        if index % self._stride == 0:
            self._kept.append(_reduced(grey))

    def edges(self, moved: bool, width: int, height: int) -> Float[np.ndarray, "N 4"] | None:
        """Return the ends (x0, y0, x1, y1) of edges, pixels of the upright image; None without a
        picture.

        Args:
            moved: Whether the camera moved.
            width, height: Size of the upright image, pixels.
        """
        if not self._kept:
            return None
        one = moved or len({image.shape for image in self._kept}) > 1
        picture = self._kept[0] if one else np.median(self._kept, 0).astype(np.uint8)
        scale = np.array([width / picture.shape[1], height / picture.shape[0]])
        edges: np.ndarray = np.round(straight_edges(picture) * np.tile(scale, 2), 2)
        return edges


def straight_edges(picture: UInt8[np.ndarray, "H W"]) -> Float[np.ndarray, "N 4"]:
    """Return the longest straight edges of a picture without plain bars at its borders (LSD: von
    Gioi et al., 2010), pixels."""
    rows, columns = _shown(picture.std(1)), _shown(picture.std(0))
    inside = np.ascontiguousarray(picture[rows, columns])
    found = cv2.createLineSegmentDetector().detect(inside)[0] if inside.size else None
    lines = np.zeros((0, 4)) if found is None else np.asarray(found, float).reshape(-1, 4)
    lines = lines + np.tile([columns.start, rows.start], 2)
    along = lines[:, 2:] - lines[:, :2]
    length = np.linalg.norm(along, axis=1)
    tilt = np.abs(along).min(1) / np.maximum(length, 1e-9)
    height, width = picture.shape
    side = np.where(np.abs(along[:, 0]) > np.abs(along[:, 1]), float(width), float(height))
    drawn = (tilt < OVERLAY_TILT) & (length > OVERLAY_LENGTH * side)
    kept = (length > LEAST_LENGTH * float(np.hypot(width, height))) & ~drawn
    longest = np.flatnonzero(kept)[np.argsort(-length[kept])][:MOST]
    result: np.ndarray = lines[longest]
    return result


def _shown(spread: Float[np.ndarray, " N"]) -> slice:
    """Return the rows or columns between the plain ones at both borders."""
    shown = np.flatnonzero(spread > PLAIN)
    return slice(int(shown[0]), int(shown[-1]) + 1) if len(shown) else slice(0, 0)


def _reduced(grey: UInt8[np.ndarray, "H W"]) -> UInt8[np.ndarray, "h w"]:
    factor = SHORT_SIDE / min(grey.shape)
    if factor >= 1.0:
        return grey.copy()
    return np.asarray(cv2.resize(grey, None, fx=factor, fy=factor, interpolation=cv2.INTER_AREA))
