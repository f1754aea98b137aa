"""Extent of the person in a clip, from landmarks: in full view or cut off, and how large."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float

from robojackson.errors import UnknownName
from robojackson.motion.landmark_track import LandmarkTrack

POINTS = {
    "nose": 0,
    "left_shoulder": 11,
    "right_shoulder": 12,
    "left_elbow": 13,
    "right_elbow": 14,
    "left_wrist": 15,
    "right_wrist": 16,
    "left_hip": 23,
    "right_hip": 24,
    "left_knee": 25,
    "right_knee": 26,
    "left_ankle": 27,
    "right_ankle": 28,
}
"""Landmarks of BlazePose."""
BODY = tuple(name for name in POINTS if not name.endswith(("elbow", "wrist")))
"""Arms pass behind the body and out of the picture in any dance, so they are not required."""
MIRROR = (0, 4, 5, 6, 1, 2, 3, 8, 7, 10, 9) + tuple(i + (1 if i % 2 else -1) for i in range(11, 33))
"""Number of the landmark that each one becomes in a mirror."""


def indices(names: Sequence[str]) -> list[int]:
    """Return the numbers of landmarks by name."""
    for name in names:
        if name not in POINTS:
            raise UnknownName("landmark", name, "clips.people.person_extent", POINTS)
    return [POINTS[name] for name in names]


def trunk() -> list[int]:
    """Return the numbers of the trunk's corners."""
    return indices(("left_shoulder", "right_shoulder", "left_hip", "right_hip"))


def full_body(track: LandmarkTrack, visibility: float) -> Bool[np.ndarray, " T"]:
    """Return frames in which head, trunk and legs are inside the image and seen."""
    chosen = indices(BODY)
    xy = track.landmarks[:, chosen, :2]
    inside = ((xy >= 0.0) & (xy <= 1.0)).all((1, 2))
    return np.asarray(inside & (track.visibility[:, chosen] >= visibility).all(1))


def heights_px(track: LandmarkTrack) -> Float[np.ndarray, " T"]:
    """Return the distance from the highest to the lowest landmark, pixels, NaN where no person was
    found."""
    rows = track.landmarks[..., 1] * track.height
    result: np.ndarray = rows.max(1) - rows.min(1)
    return result


def stature(points: Float[np.ndarray, "*T 33 2"]) -> Float[np.ndarray, "*T"]:
    """Return nose to neck to hips to the foot of the longer leg: a size that poses hardly change.

    Args:
        points: Landmarks in pixels.
    """

    def middle(name: str) -> np.ndarray:
        result: np.ndarray = points[..., indices((f"left_{name}", f"right_{name}")), :].mean(-2)
        return result

    def leg(side: str) -> np.ndarray:
        chain = points[..., indices(tuple(f"{side}_{n}" for n in ("hip", "knee", "ankle"))), :]
        result: np.ndarray = np.linalg.norm(np.diff(chain, axis=-2), axis=-1).sum(-1)
        return result

    neck, hips = middle("shoulder"), middle("hip")
    head = np.linalg.norm(points[..., POINTS["nose"], :] - neck, axis=-1)
    legs = np.maximum(leg("left"), leg("right"))
    return np.asarray(head + np.linalg.norm(neck - hips, axis=-1) + legs)


def box(
    xy: Float[np.ndarray, "33 2"], margin: float, width: int, height: int
) -> tuple[int, int, int, int] | None:
    """Return the person's box (x0, y0, x1, y1) in pixels of an image, None without a person.

    Args:
        xy: Landmarks in image coordinates, 0..1.
        margin: Added on each side, in sizes of the box.
        width, height: Width and height of the image, pixels.
    """
    if np.isnan(xy).any():
        return None
    low, high = xy.min(0), xy.max(0)
    room = margin * (high - low)
    size = np.array([width, height])
    x0, y0 = np.clip((low - room) * size, 0, size).astype(int)
    x1, y1 = np.clip(np.ceil((high + room) * size), 0, size).astype(int)
    return int(x0), int(y0), int(x1), int(y1)


def place_of(
    row: Float[np.ndarray, "33 _"], size: tuple[int, ...]
) -> tuple[Float[np.ndarray, "2"], float]:
    """Return the middle of the trunk and the stature of a person, pixels.

    Args:
        row: Landmarks; the first two columns are the place in the image, 0..1.
        size: Width and height of the picture, pixels.
    """
    points = row[:, :2] * size
    return points[trunk()].mean(0), float(stature(points))
