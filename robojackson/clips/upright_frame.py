"""Pixels of a decoded frame: RGB, square, upright, and no larger than needed."""

import cv2
import numpy as np
from av.sidedata.sidedata import SideData
from av.video.frame import VideoFrame
from jaxtyping import UInt8

TURNS = {
    1: cv2.ROTATE_90_COUNTERCLOCKWISE,
    2: cv2.ROTATE_180,
    3: cv2.ROTATE_90_CLOCKWISE,
}
"""Quarter turns anticlockwise that set an image upright; seven times as fast as numpy's."""
NEARLY = 1.1
"""Making an image smaller costs more than a tenth of its pixels."""


def upright(
    frame: VideoFrame, short_side: int | None, aspect: float = 1.0
) -> UInt8[np.ndarray, "H W 3"]:
    """Return the pixels of a frame, made square, mirrored and turned as its display matrix says.

    Args:
        frame: A decoded frame.
        aspect: Width of a stored pixel over its height (`pixel_aspect`).
        short_side: Images that are larger by more than a tenth are made smaller until their short
            side has so many pixels.
    """
    wide = frame.width * aspect
    shortest = min(wide, frame.height)
    factor = 1.0
    if short_side is not None and shortest > NEARLY * short_side:
        factor = short_side / shortest
    if (factor, aspect) != (1.0, 1.0):
        width, height = round(wide * factor), round(frame.height * factor)
        image = _pixels(frame.reformat(width, height, format="rgb24", interpolation="AREA"))
    else:
        image = _pixels(frame.reformat(format="rgb24"))
    if mirrored(frame):
        image = cv2.flip(image, 0)
    turn = TURNS.get(round(frame.rotation / 90) % 4)
    return image if turn is None else cv2.rotate(image, turn)


def mirrored(frame: VideoFrame) -> bool:
    """Return whether a frame is shown mirrored: upside down first, then turned by its rotation.

    The rotation is read from the first column of the display matrix (FFmpeg's nine 16.16 numbers),
    a mirror from the sign of its determinant.
    """
    tag = frame.side_data.get("DISPLAYMATRIX")
    if not isinstance(tag, SideData):
        return False
    a, b, _, c, d = np.frombuffer(bytes(tag), np.int32, 5).tolist()
    return bool(a * d - b * c < 0)


def _pixels(frame: VideoFrame) -> UInt8[np.ndarray, "H W 3"]:
    """Return the pixels of an RGB frame without padding: half the time of `frame.to_ndarray`."""
    plane = frame.planes[0]
    rows = np.frombuffer(memoryview(plane), np.uint8).reshape(plane.height, plane.line_size)
    used = np.ascontiguousarray(rows[:, : 3 * plane.width])
    return used.reshape(plane.height, plane.width, 3)
