"""The pixels that a person covers, painted over, and the colours of his clothes."""

import cv2
import numpy as np
from jaxtyping import Bool, Float, UInt8

from robojackson.clips.people.person_extent import indices, stature, trunk

CHAINS = (
    (19, 15, 13, 11), (20, 16, 14, 12), (23, 25, 27, 29, 31), (24, 26, 28, 30, 32), (27, 31),
    (28, 32), (7, 8),
)  # fmt: skip
"""Limbs as chains of landmarks, fingers and toes included."""
FACE = slice(0, 11)
HEAD_RADIUS, NECK_WIDTH = 0.09, 0.08
"""Body heights."""
COLOUR_VALUES = 6
SAMPLE_WIDTH = 0.03
FEWEST_PIXELS = 12


def silhouette(
    xy: Float[np.ndarray, "33 2"], width: int, height: int, limb_width: float
) -> Bool[np.ndarray, "H W"]:
    """Return the pixels that a person covers, limbs `limb_width` body heights wide."""
    points = np.round(xy * [width, height]).astype(np.int32)
    tall = float(stature(points))
    thick = max(2, round(limb_width * tall))
    mask = np.zeros((height, width), np.uint8)
    hull = cv2.convexHull(points[trunk()])
    cv2.fillConvexPoly(mask, hull, 1)
    cv2.polylines(mask, [hull], True, 1, thick)
    for chain in CHAINS:
        cv2.polylines(mask, [points[list(chain)]], False, 1, thick)
    head = points[FACE].mean(0)
    middle = points[indices(("left_shoulder", "right_shoulder"))].mean(0)
    cv2.line(mask, _pixel(head), _pixel(middle), 1, max(2, round(NECK_WIDTH * tall)))
    cv2.circle(mask, _pixel(head), max(2, round(HEAD_RADIUS * tall)), 1, -1)
    return mask.astype(bool)


def paint(image: UInt8[np.ndarray, "H W 3"], mask: Bool[np.ndarray, "H W"]) -> None:
    """Fill pixels with the mean colour of the picture."""
    image[mask] = cv2.mean(image)[:3]


def mean_colours(
    image: UInt8[np.ndarray, "H W 3"], xy: Float[np.ndarray, "33 2"], hidden: np.ndarray
) -> Float[np.ndarray, " 6"]:
    """Return the mean colour of trunk and thighs where nothing hides them."""
    height, width = image.shape[:2]
    points = np.round(xy * [width, height]).astype(np.int32)
    upper, lower = np.zeros((2, height, width), np.uint8)
    cv2.fillConvexPoly(upper, cv2.convexHull(points[trunk()]), 1)
    thick = max(1, round(SAMPLE_WIDTH * float(stature(points))))
    for side in ("left", "right"):
        ends = points[indices((f"{side}_hip", f"{side}_knee"))].tolist()
        cv2.line(lower, ends[0], ends[1], 1, thick)
    return np.concatenate([_colour(image, (part > 0) & ~hidden) for part in (upper, lower)])


def _colour(image: np.ndarray, mask: np.ndarray) -> np.ndarray:
    pixels = image[mask]
    if len(pixels) < FEWEST_PIXELS:
        return np.full(3, np.nan)
    result: np.ndarray = cv2.cvtColor(pixels[None], cv2.COLOR_RGB2LAB)[0].mean(0)
    return result


def _pixel(point: np.ndarray) -> tuple[int, int]:
    return round(float(point[0])), round(float(point[1]))
