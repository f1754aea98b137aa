"""Drawing on pictures: lines in depth order, labels, crops. RGB uint8, pixels, origin top left."""

from collections.abc import Sequence
from functools import lru_cache

import cv2
import numpy as np
from jaxtyping import Float, UInt8
from PIL import Image, ImageDraw, ImageFont

Picture = UInt8[np.ndarray, "H W 3"]
Colour = tuple[int, int, int]

LEFT: Colour = (64, 200, 255)
RIGHT: Colour = (255, 150, 70)
MIDDLE: Colour = (225, 228, 235)
BACKDROP: Colour = (24, 27, 34)
GRID: Colour = (62, 70, 84)
"""Colours of the subject's left, right and middle in every panel."""
SUBPIXEL_BITS = 4
OUTSIDE = 0.25
"""Largest distance outside the image at which a crop follows a point, image sizes."""


def side_colour(name: str) -> Colour:
    """Return the colour of a landmark or keypoint by the side in its name."""
    if "left" in name:
        return LEFT
    return RIGHT if "right" in name else MIDDLE


def draw_line(
    picture: Picture, start: np.ndarray, end: np.ndarray, colour: Colour, width: int
) -> None:
    """Draw a smooth line in place; NaN ends draw nothing."""
    if not (np.isfinite(start).all() and np.isfinite(end).all()):
        return
    a, b = _fixed_point(start), _fixed_point(end)
    cv2.line(picture, a, b, colour, width, cv2.LINE_AA, SUBPIXEL_BITS)


def draw_dot(picture: Picture, centre: np.ndarray, colour: Colour, radius: int) -> None:
    """Draw a smooth dot in place; NaN draws nothing."""
    if np.isfinite(centre).all():
        at = _fixed_point(centre)
        size = radius << SUBPIXEL_BITS
        cv2.circle(picture, at, size, colour, -1, cv2.LINE_AA, SUBPIXEL_BITS)


def label(picture: Picture, title: str, note: str = "") -> None:
    """Draw a title, and a note in grey after it, on a darkened strip at the top, in place."""
    strip = _strip(title, note, picture.shape[1], picture.shape[0])
    height = strip.shape[0]
    mixed = picture[:height] * 0.25 + strip * 0.75
    bright = strip.max(-1, keepdims=True) > 60
    picture[:height] = np.where(bright, strip, mixed).astype(np.uint8)


def strip_height(width: int, height: int) -> int:
    """Return the height of the title's strip over a panel of that size, pixels."""
    return 2 * _letter_height(width, height)


def crop_box(
    points: Float[np.ndarray, "N 2"], size: tuple[int, int], aspect: float, margin: float = 0.15
) -> tuple[int, int, int, int]:
    """Return a box (left, top, width, height) of the given width / height around points in an
    image.

    Args:
        points: Pixels, NaN where nothing was seen; without any point the whole image is used.
        size: Width and height of the image.
        aspect: Width over height of the box; the box may extend beyond the image.
        margin: Share of the person's size that is added on every side.
    """
    seen = points[np.isfinite(points).all(1)]
    low, high = (seen.min(0), seen.max(0)) if len(seen) else (np.zeros(2), np.array(size, float))
    beyond = OUTSIDE * np.array(size, float)
    low, high = np.maximum(low, -beyond), np.minimum(high, np.array(size, float) + beyond)
    extent = (high - low) * (1.0 + 2.0 * margin if len(seen) else 1.0)
    height = max(extent[1], extent[0] / aspect, 2.0)
    width = height * aspect
    left, top = (low + high) / 2.0 - np.array([width, height]) / 2.0
    return round(left), round(top), round(width), round(height)


def cut(picture: Picture, box: tuple[int, int, int, int], size: tuple[int, int]) -> Picture:
    """Return the part of a picture inside a box, scaled to (width, height); outside it is
    backdrop."""
    left, top, width, height = box
    scale = np.array([size[0] / width, size[1] / height])
    warp = np.array([[scale[0], 0.0, -left * scale[0]], [0.0, scale[1], -top * scale[1]]])
    mode = cv2.INTER_AREA if scale[0] < 1.0 else cv2.INTER_LINEAR
    if scale[0] < 0.5:
        blur = round(1.0 / scale[0]) | 1
        picture = cv2.blur(picture, (blur, blur))
    return cv2.warpAffine(
        picture, warp, size, flags=mode, borderMode=cv2.BORDER_CONSTANT, borderValue=BACKDROP
    )


def side_by_side(panels: Sequence[Picture], gap: int = 2) -> Picture:
    """Return panels of one height in a row, with a thin gap."""
    height = panels[0].shape[0]
    spacer = np.full((height, gap, 3), GRID, np.uint8)
    row: list[Picture] = []
    for panel in panels:
        row += [spacer, panel]
    joined = np.concatenate(row[1:], axis=1)
    return np.ascontiguousarray(joined[: height // 2 * 2, : joined.shape[1] // 2 * 2])


@lru_cache(maxsize=64)
def _strip(title: str, note: str, width: int, height: int) -> Picture:
    size = _letter_height(width, height)
    image = Image.new("RGB", (width, size * 2), (16, 18, 24))
    draw = ImageDraw.Draw(image)
    font = ImageFont.load_default(size)
    draw.text((size // 2, size * 0.4), title, font=font, fill=(240, 242, 246))
    start = size + draw.textlength(title, font=font)
    draw.text((start, size * 0.4), note, font=font, fill=(150, 158, 172))
    return np.array(image)


def _letter_height(width: int, height: int) -> int:
    return max(11, min(width // 22, height // 30))


def _fixed_point(at: np.ndarray) -> tuple[int, int]:
    x, y = np.clip(at, -1e4, 1e4) * (1 << SUBPIXEL_BITS)
    return int(x), int(y)
