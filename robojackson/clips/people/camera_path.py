"""Motion of the camera: register the background of every frame with that of the first.

Corners outside the person's box are followed by Lucas-Kanade from frame to frame; what most of them
did together (RANSAC) is the camera's motion as a homography, exact for a camera that turns or zooms
in place. A link of the chain lasts until too few of its corners are left. The camera stands until
shown to move: where a fair share of the corners has kept its place, it did not (the rest are
people), and a motion is believed only of corners spread over the image. What cannot be laid onto
the frame before is a jump if much of the picture changed (a cut, a violent shake); else it shows
nothing (a bare wall), and the camera is left where it was.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise

import cv2
import numpy as np
from jaxtyping import Float, Float32, UInt8

from robojackson.clips.people.camera_motion import (
    CORNER_DISTANCE,
    CORNER_QUALITY,
    LEAST_TEXTURE,
    PERSON_MARGIN,
    grey_levels,
)
from robojackson.clips.people.person_extent import box

CORNERS, FEWEST = 160, 12
CELLS = 3, 4
"""Rows and columns of the image that share the corners evenly."""
RENEW = 0.6
"""Corners are found again when fewer than this share of them is left."""
INLIER = 1.5
"""Pixels of the small picture; a corner further off did not move with the background."""
AGREED = 0.5
"""Least share of the corners that must move together."""
MATCHED_SHARE = 0.75
"""Pixels of the small picture; a corner nearer to where its link began has kept its place."""
STANDS, FEWEST_STANDING = 0.4, 6
"""Least share and number of corners that keep their place while the camera stands."""
SPREAD = 0.25
"""Least share of the image inside the hull of the corners by which a motion is believed."""
CHANGED, CHANGED_SHARE = 5.0, 30
"""A frame is another picture if more than CHANGED_SHARE percent of the background's pixels changed
by more than CHANGED, of 255."""
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
        """Whether the camera moved, as far as the background shows it."""
        return bool(self.stray > STILL)

    @property
    def notes(self) -> tuple[str, ...]:
        """What the user must know; nothing where the camera stood."""
        messages = []
        lost = np.flatnonzero(self.jumps)
        if len(lost):
            messages.append(
                f"background jumps in {len(lost)} of {len(self.jumps)} frames (first: {lost[0]}), "
                "a cut or a violent shake: the path through the room is not to be trusted"
            )
        if self.blind.mean() > BLIND_SHARE:
            messages.append(
                f"whether the camera moved cannot be seen in {self.blind.mean():.0%} of the "
                "frames: the background shows no corners"
            )
        if self.moved:
            messages.append(
                f"the camera moved by {self.stray:.0%} of the image: taken out by its background"
            )
        return tuple(messages)


def camera_path(
    images: Iterable[UInt8[np.ndarray, "H W 3"]],
    landmarks: Float[np.ndarray, "T 33 2"],
    width: int,
    height: int,
) -> CameraPath:
    """Return the camera's motion.

    Args:
        images: RGB frames, upright, of any one size.
        landmarks: Landmarks of the person, 0..1, NaN where no person was detected.
        width, height: Width and height of the full upright image, pixels.
    """
    follower = CameraFollower()
    for image, xy in zip(images, landmarks, strict=False):
        follower.add_frame(image, xy)
    return follower.path(len(landmarks), width, height)


def warp(
    points: Float[np.ndarray, "T N 2"], to_first: Float[np.ndarray, "T 3 3"]
) -> Float[np.ndarray, "T N 2"]:
    """Return pixels of each frame as pixels of the first."""
    ahead = np.concatenate([points, np.ones((*points.shape[:2], 1))], -1)
    moved = np.einsum("tij,tnj->tni", to_first, ahead)
    return np.asarray(moved[..., :2] / moved[..., 2:])


def stray_of(to_first: Float[np.ndarray, "T 3 3"], width: int, height: int) -> float:
    """Return the greatest displacement of the corners and the middle of the image, diagonals."""
    marks = np.array([[0, 0], [1, 0], [0, 1], [1, 1], [0.5, 0.5]]) * [width, height]
    moved = warp(np.broadcast_to(marks, (len(to_first), 5, 2)), to_first)
    return float(np.linalg.norm(moved - marks, axis=-1).max() / np.hypot(width, height))


class CameraFollower:
    """Follows corners from frame to frame, as the frames pass by."""

    def __init__(self) -> None:
        self.to_first: list[np.ndarray] = []
        self.jumps: list[bool] = []
        self.blind: list[bool] = []
        self.size = (1, 1)
        self._before: np.ndarray | None = None
        self._start = np.eye(3)
        self._from = self._at = np.zeros((0, 1, 2), np.float32)
        self._found = 0

    def path(self, frames: int, width: int, height: int) -> CameraPath:
        """Return the camera's motion over a number of frames, pixels of the full upright image."""
        small = np.array(self.to_first[:frames])
        missing = max(frames - len(small), 0)
        small = np.concatenate([small, np.repeat(small[-1:], missing, axis=0)])
        blind = np.array((self.blind + [True] * missing)[:frames])
        jumps = np.array((self.jumps + [False] * missing)[:frames])
        scale = np.diag([width / self.size[0], height / self.size[1], 1.0])
        full = scale @ small @ np.linalg.inv(scale)
        stray = stray_of(full, width, height)
        still = np.broadcast_to(np.eye(3), full.shape).copy()
        return CameraPath(still if stray <= STILL else full, jumps, blind, stray)

    def add_frame(self, image: UInt8[np.ndarray, "H W *C"], xy: Float[np.ndarray, "33 2"]) -> None:
        """Add the next frame, RGB or grey, and the person in it, 0..1, NaN where none was found."""
        grey = grey_levels(image)
        self.size = (grey.shape[1], grey.shape[0])
        step = self._followed(grey)
        last = self.to_first[-1] if self.to_first else np.eye(3)
        self.to_first.append(last if step is None else self._start @ step)
        self.jumps.append(step is None and self._changed(grey, xy))
        self.blind.append(step is None and self._before is not None and not self.jumps[-1])
        if step is None or len(self._at) < max(FEWEST, RENEW * self._found):
            self._start = self.to_first[-1]
            self._from = self._at = _corners(grey, xy)
            self._found = len(self._at)
        self._before = grey

    def _followed(self, grey: np.ndarray) -> np.ndarray | None:
        """Return the map from this frame to the start of the link; None where the background was
        lost."""
        before = self._before
        if before is None or before.shape != grey.shape or len(self._at) < FEWEST_STANDING:
            return None
        moved, found, _ = cv2.calcOpticalFlowPyrLK(
            before, grey, self._at, self._at.copy(), minEigThreshold=LEAST_TEXTURE
        )
        kept = found.ravel() == 1
        steps = np.linalg.norm((moved - self._at)[:, 0], axis=-1) / np.hypot(*self.size)
        start, now = self._from[kept], moved[kept]
        fit, agreed = _still(now, start), np.ones(len(now), bool)
        if fit is None and kept.sum() >= FEWEST and np.median(steps[kept]) <= JERK:
            fit, agreed = self._moving(now, start)
        if fit is not None:
            self._from, self._at = start[agreed], now[agreed]
        return fit

    def _moving(self, now: np.ndarray, start: np.ndarray) -> tuple[np.ndarray | None, np.ndarray]:
        """Return what most corners did together, if spread over the image; and which did."""
        fit, inlier = cv2.findHomography(now, start, cv2.RANSAC, INLIER)
        if fit is None:
            return None, np.zeros(len(now), bool)
        agreed = inlier.ravel() == 1
        if agreed.mean() < AGREED or agreed.sum() < FEWEST:
            return None, agreed
        hull = cv2.contourArea(cv2.convexHull(now[agreed]))
        return (np.asarray(fit) if hull >= SPREAD * np.prod(self.size) else None), agreed

    def _changed(self, grey: np.ndarray, xy: np.ndarray) -> bool:
        """Return whether the background is another picture than before; blurred, so that noise is
        none."""
        if self._before is None:
            return False
        if self._before.shape != grey.shape:
            return True
        before, after = (cv2.GaussianBlur(image, (5, 5), 0) for image in (self._before, grey))
        change = cv2.absdiff(before, after)[_mask(grey, xy) > 0]
        return bool(len(change) and np.percentile(change, 100 - CHANGED_SHARE) > CHANGED)


def _still(now: np.ndarray, start: np.ndarray) -> np.ndarray | None:
    """Return the identity if enough corners have kept their place."""
    near = np.linalg.norm((now - start)[:, 0], axis=-1) < MATCHED_SHARE
    stands = near.sum() >= max(FEWEST_STANDING, STANDS * len(near))
    return np.eye(3) if stands else None


def _mask(grey: np.ndarray, xy: np.ndarray) -> np.ndarray:
    """Return 255 outside the person's box."""
    mask = np.full_like(grey, 255)
    person = box(xy, PERSON_MARGIN, grey.shape[1], grey.shape[0])
    if person:
        x0, y0, x1, y1 = person
        mask[y0:y1, x0:x1] = 0
    return mask


def _corners(grey: np.ndarray, xy: np.ndarray) -> Float32[np.ndarray, "N 1 2"]:
    """Return the best corners of each cell of the image: one striking object has no more votes than
    others.

    What is no corner but noise is lost at once by Lucas-Kanade (`LEAST_TEXTURE`).
    """
    mask, found = _mask(grey, xy), list[np.ndarray]([np.zeros((0, 1, 2), np.float32)])
    rows, columns = (
        np.linspace(0, n, m + 1).astype(int) for n, m in zip(grey.shape, CELLS, strict=True)
    )
    each = CORNERS // (CELLS[0] * CELLS[1])
    for y0, y1 in pairwise(rows):
        for x0, x1 in pairwise(columns):
            best = cv2.goodFeaturesToTrack(
                grey[y0:y1, x0:x1], each, CORNER_QUALITY, CORNER_DISTANCE, mask=mask[y0:y1, x0:x1]
            )
            if best is not None:
                found.append(best + np.array([x0, y0], np.float32))
    return np.concatenate(found)
