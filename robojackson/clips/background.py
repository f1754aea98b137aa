"""How the camera moved: the background of every frame laid onto that of the first.

Corners outside the person's box are followed by Lucas-Kanade from frame to frame; what most of them
did together (RANSAC) is the camera's motion as a homography, exact for a camera that turns or zooms
in place. A link of the chain lasts until too few of its corners are left. A frame whose background
cannot be laid onto the one before (a cut, a violent shake, a bare wall) breaks the chain and is
told.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Float, UInt8

from robojackson.clips.camera import CORNER_DISTANCE, CORNER_QUALITY, LEAST_TEXTURE, PERSON_MARGIN
from robojackson.clips.person import box

CORNERS, FEWEST = 160, 12
RENEW = 0.6
"""Corners are found anew when fewer than this share of them is left."""
INLIER = 1.5
"""Pixels of the small picture; a corner further off did not move with the background."""
AGREED = 0.5
"""Least share of the corners that must move together."""
STILL = 0.01
"""A camera whose background strays less than this from the first frame stands, image diagonals."""
BLIND_SHARE = 0.3
JERK = 0.06
"""Largest step between two frames that is believed, image diagonals."""


@dataclass(frozen=True)
class CameraPath:
    """Motion of the background through a clip.

    Attributes:
        to_first: Takes pixels of each frame to those of the first (upright image, full size).
        jumps: Frames that could not be laid onto the one before.
        blind: Frames in which the background shows no corners.
        stray: Greatest displacement of the image's corners and middle, diagonals.
    """

    to_first: Float[np.ndarray, "T 3 3"]
    jumps: np.ndarray
    blind: np.ndarray
    stray: float

    @property
    def moved(self) -> bool:
        """Whether the camera moved, as far as it was seen."""
        return bool(self.stray > STILL)

    @property
    def notes(self) -> tuple[str, ...]:
        """What the user must know; nothing where the camera stood."""
        told = []
        lost = np.flatnonzero(self.jumps)
        if len(lost):
            told.append(
                f"the background jumps in {len(lost)} frames (first: {lost[0]}), a cut or a "
                "violent shake: the path through the room is not to be trusted"
            )
        if self.blind.mean() > BLIND_SHARE:
            told.append(
                f"whether the camera moved cannot be seen in {self.blind.mean():.0%} of the "
                "frames: the background shows no corners"
            )
        if self.moved:
            told.append(
                f"the camera moved by {self.stray:.0%} of the image: taken out by its background"
            )
        return tuple(told)


def camera_path(
    images: Iterable[UInt8[np.ndarray, "H W 3"]],
    landmarks: Float[np.ndarray, "T 33 2"],
    width: int,
    height: int,
) -> CameraPath:
    """The camera's motion.

    Args:
        images: RGB frames, upright, of any one size.
        landmarks: Of the person, 0..1, NaN where nobody was found.
        width, height: Of the full upright image, pixels.
    """
    chain = _Chain()
    for image, xy in zip(images, landmarks, strict=False):
        chain.see(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY), xy)
    small = np.array(chain.to_first[: len(landmarks)])
    missing = max(len(landmarks) - len(small), 0)
    small = np.concatenate([small, np.repeat(small[-1:], missing, axis=0)])
    blind = np.array((chain.blind + [True] * missing)[: len(small)])
    jumps = np.array((chain.jumps + [False] * missing)[: len(small)])
    scale = np.diag([width / chain.size[0], height / chain.size[1], 1.0])
    full = scale @ small @ np.linalg.inv(scale)
    stray = _stray(full, width, height)
    if stray <= STILL:
        full = np.broadcast_to(np.eye(3), full.shape).copy()
    return CameraPath(full, jumps, blind, stray)


def warp(
    points: Float[np.ndarray, "T N 2"], to_first: Float[np.ndarray, "T 3 3"]
) -> Float[np.ndarray, "T N 2"]:
    """Pixels of each frame as pixels of the first."""
    ahead = np.concatenate([points, np.ones((*points.shape[:2], 1))], -1)
    moved = np.einsum("tij,tnj->tni", to_first, ahead)
    return np.asarray(moved[..., :2] / moved[..., 2:])


class _Chain:
    """Follows corners from frame to frame."""

    def __init__(self) -> None:
        self.to_first: list[np.ndarray] = []
        self.jumps: list[bool] = []
        self.blind: list[bool] = []
        self.size = (1, 1)
        self._before: np.ndarray | None = None
        self._start = np.eye(3)
        self._from = self._at = np.zeros((0, 1, 2), np.float32)
        self._found = 0

    def see(self, grey: UInt8[np.ndarray, "H W"], xy: Float[np.ndarray, "33 2"]) -> None:
        """The next frame."""
        self.size = (grey.shape[1], grey.shape[0])
        followed = self._before is not None and len(self._at) >= FEWEST
        step = self._followed(grey) if followed else None
        last = self.to_first[-1] if self.to_first else np.eye(3)
        self.to_first.append(last if step is None else self._start @ step)
        self.jumps.append(followed and step is None)
        if step is None or len(self._at) < max(FEWEST, RENEW * self._found):
            self._start = self.to_first[-1]
            self._from = self._at = _corners(grey, xy)
            self._found = len(self._at)
        self.blind.append(len(self._at) < FEWEST)
        self._before = grey

    def _followed(self, grey: np.ndarray) -> np.ndarray | None:
        """From this frame to the start of the link; None where the background was lost."""
        if self._before is None or self._before.shape != grey.shape:
            return None
        moved, found, _ = cv2.calcOpticalFlowPyrLK(
            self._before, grey, self._at, self._at.copy(), minEigThreshold=LEAST_TEXTURE
        )
        kept = found.ravel() == 1
        steps = np.linalg.norm((moved - self._at)[:, 0], axis=-1) / np.hypot(*self.size)
        start, now = self._from[kept], moved[kept]
        if kept.sum() < FEWEST or np.median(steps[kept]) > JERK:
            return None
        fit, inlier = cv2.findHomography(now, start, cv2.RANSAC, INLIER)
        if fit is None or inlier.mean() < AGREED:
            return None
        agreed = inlier.ravel() == 1
        self._from, self._at = start[agreed], now[agreed]
        return np.asarray(fit)


def _corners(grey: np.ndarray, xy: np.ndarray) -> np.ndarray:
    mask = np.full_like(grey, 255)
    person = box(xy, PERSON_MARGIN, grey.shape[1], grey.shape[0])
    if person:
        x0, y0, x1, y1 = person
        mask[y0:y1, x0:x1] = 0
    found = cv2.goodFeaturesToTrack(grey, CORNERS, CORNER_QUALITY, CORNER_DISTANCE, mask=mask)
    return np.zeros((0, 1, 2), np.float32) if found is None else found


def _stray(to_first: np.ndarray, width: int, height: int) -> float:
    """Greatest displacement of the corners and the middle of the image, diagonals."""
    marks = np.array([[0, 0], [1, 0], [0, 1], [1, 1], [0.5, 0.5]]) * [width, height]
    moved = warp(np.broadcast_to(marks, (len(to_first), 5, 2)), to_first)
    return float(np.linalg.norm(moved - marks, axis=-1).max() / np.hypot(width, height))
