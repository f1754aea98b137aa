"""The square around the person that is the network's input.

A box is (centre x, centre y, side) in pixels of the upright image; the crop is 256 x 256, black
outside the image. Pixel coordinates as in the published code: the side is divided into 256 steps.
"""

import cv2
import numpy as np
from jaxtyping import Float, UInt8

from robojackson.clips.people.camera_path import warp

SIDE_PX = 256
MARGIN = 1.25
"""Side of the square over the larger side of the person's tight box."""
ABOVE, BELOW = 0.06, 0.02
"""Extent of a person above and below his landmarks, as a share of their height: the crown over the
eyes, the soles under the heels. Measured on frames of walk and dance_a."""
ASIDE = 0.03
"""Extent to both sides, as a share of their width."""
MEAN = np.array([0.406, 0.457, 0.480], np.float32)
SPREAD = np.array([0.225, 0.224, 0.229], np.float32)
"""ImageNet's statistics in the order blue, green, red, applied to red, green, blue: an oversight of
the authors that their weights have learned (one of the means is mistyped, too)."""


def person_boxes(image: Float[np.ndarray, "T 33 2"]) -> Float[np.ndarray, "T 3"]:
    """Return the network's squares around the landmarks (pixels, no gaps)."""
    low, high = image.min(1), image.max(1)
    size = high - low
    low, high = low - size * [ASIDE, ABOVE], high + size * [ASIDE, BELOW]
    side = np.maximum((high - low).max(1), 1.0) * MARGIN
    return np.concatenate([(low + high) / 2.0, side[:, None]], 1)


def moved(
    boxes: Float[np.ndarray, "T 3"], to_first: Float[np.ndarray, "T 3 3"]
) -> Float[np.ndarray, "T 3"]:
    """Return the squares in the image of the first frame, upright and scaled like there."""
    centre, half = boxes[:, None, :2], boxes[:, None, 2:] / 2.0
    across = np.array([[-1.0, 0.0], [1.0, 0.0], [0.0, -1.0], [0.0, 1.0]])
    ends = warp(centre + half * across, to_first)
    side = np.linalg.norm(ends[:, 1::2] - ends[:, ::2], axis=-1).mean(1)
    return np.concatenate([warp(centre, to_first)[:, 0], side[:, None]], 1)


def cut(image: UInt8[np.ndarray, "H W 3"], box: Float[np.ndarray, "3"]) -> np.ndarray:
    """Return the square of an RGB image, uint8 (256, 256, 3)."""
    scale = SIDE_PX / box[2]
    shift = SIDE_PX / 2.0 - box[:2] * scale
    matrix = np.array([[scale, 0.0, shift[0]], [0.0, scale, shift[1]]])
    return cv2.warpAffine(image, matrix, (SIDE_PX, SIDE_PX), flags=cv2.INTER_LINEAR)


def normalise(crops: UInt8[np.ndarray, "B 256 256 3"]) -> Float[np.ndarray, "B 3 256 256"]:
    """Return crops in the range of the network's training."""
    scaled = (crops.astype(np.float32) / 255.0 - MEAN) / SPREAD
    return np.ascontiguousarray(np.moveaxis(scaled, -1, 1))


def to_image(
    uv: Float[np.ndarray, "T J 2"], boxes: Float[np.ndarray, "T 3"]
) -> Float[np.ndarray, "T J 2"]:
    """Return pixels of the image from shares of the crop (-0.5..0.5)."""
    result: np.ndarray = boxes[:, None, :2] + uv * boxes[:, None, 2:]
    return result
