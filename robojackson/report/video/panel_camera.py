"""The camera of a panel: level, in front of its subject, near enough to fill the panel.

World: x forward, y left, z up; metres. Azimuth 0 is on the +x side, like the camera that filmed.
The camera follows its subject over the floor; its distance and the height that it looks at
(`Framing`) are the same for a whole video, so that no picture of it cuts the subject.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.ndimage import gaussian_filter1d

from robojackson.report.video.canvas import strip_height

FOCAL = 2.2
"""Focal length over the height of the panel."""
DISTANCE, CAMERA_HEIGHT, LOOK_AT_HEIGHT = 5.0, 1.35, 0.9
"""Default distance and height, metres over the floor, where nothing is fitted."""
PITCH = float(np.arctan2(CAMERA_HEIGHT - LOOK_AT_HEIGHT, DISTANCE))
"""Downward angle of the camera, radians."""
NEAR, CLOSEST = 0.3, 1.5
"""Metres: nothing nearer than the first is drawn, no camera comes nearer than the second."""
SMOOTHING_S = 0.5
"""Time constant of a following camera, seconds."""
ROOM = 0.035
"""Margin on each side of the subject, share of the panel's height."""
HEIGHTS, NEARLY = 256, 1.02
"""Heights that are tried; share of the least distance up to which a height is as good."""


@dataclass(frozen=True)
class Framing:
    """Distance and height of a camera relative to its subject.

    Attributes:
        distance: Distance from the camera to the point that it looks at, metres.
        look_at_height: Height of that point above the floor, metres.
    """

    distance: float = float(np.hypot(DISTANCE, CAMERA_HEIGHT - LOOK_AT_HEIGHT))
    look_at_height: float = LOOK_AT_HEIGHT


@dataclass(frozen=True)
class Subject:
    """The subject that a camera has to hold in its picture.

    Attributes:
        points: Its points at all times, relative to the camera's target on the floor, metres.
        azimuth_deg: Azimuth of the camera.
    """

    points: Float[np.ndarray, "N 3"]
    azimuth_deg: float


@dataclass(frozen=True)
class View:
    """A pinhole camera.

    Attributes:
        target: Target on the floor, metres.
        eye: Position, world, metres.
        axes: Rows right, down, forward, world.
        focal: Focal length, pixels.
        centre: Centre of the image, pixels.
    """

    target: Float[np.ndarray, "2"]
    eye: Float[np.ndarray, "3"]
    axes: Float[np.ndarray, "3 3"]
    focal: float
    centre: tuple[float, float]

    def project(self, points: Float[np.ndarray, "*B 3"]) -> Float[np.ndarray, "*B 2"]:
        """Return pixels; NaN behind the camera."""
        right, down, depth = np.moveaxis((points - self.eye) @ self.axes.T, -1, 0)
        depth = np.where(depth > NEAR, depth, np.nan)
        u = self.centre[0] + self.focal * right / depth
        return np.stack([u, self.centre[1] + self.focal * down / depth], -1)


def smooth_camera_path(points: Float[np.ndarray, "T 3"], fps: float) -> Float[np.ndarray, "T 2"]:
    """Return the target on the floor of a camera that follows a point smoothly."""
    result: np.ndarray = gaussian_filter1d(points[:, :2], SMOOTHING_S * fps, axis=0, mode="nearest")
    return result


def view_of(
    target: Float[np.ndarray, "2"],
    azimuth_deg: float,
    width: int,
    height: int,
    framing: Framing | None = None,
) -> View:
    """Return the camera that looks at a place on the floor; azimuth 0 is on the +x side."""
    framing = framing or Framing()
    axes = _axes(azimuth_deg)
    aim = np.array([*target, framing.look_at_height])
    eye = aim - framing.distance * axes[2]
    return View(target, eye, axes, FOCAL * height, (width / 2, height / 2))


def fit(subjects: Sequence[Subject], width: int, height: int) -> Framing:
    """Return the nearest camera whose panel holds each subject at all times, below the title.

    Each edge of the panel requires a distance that is linear in the height of the point looked at:
    focal * offset <= room * (distance + depth). Of the heights with nearly the least distance, the
    one that leaves the same room above and below is used: where the sides decide, many are.

    Args:
        width, height: Size of a panel, pixels.
    """
    known = [(each.points[np.isfinite(each.points).all(1)], each.azimuth_deg) for each in subjects]
    known = [(points, azimuth) for points, azimuth in known if len(points)]
    if not known:
        return Framing()
    level = np.concatenate([points[:, 2] for points, _ in known])
    heights = np.linspace(level.min(), level.max(), HEIGHTS)
    needed = np.full((4, HEIGHTS), CLOSEST)
    for points, azimuth_deg in known:
        for edge, normal in enumerate(_edges(_axes(azimuth_deg), width, height)):
            least = (points @ normal).max() - heights * normal[2]
            needed[edge] = np.maximum(needed[edge], least)
    distance, (below, above) = needed.max(0), needed[2:]
    near = np.flatnonzero(distance <= NEARLY * distance.min())
    best = int(near[np.abs(above - below)[near].argmin()])
    return Framing(float(distance[best]), float(heights[best]))


def _edges(axes: Float[np.ndarray, "3 3"], width: int, height: int) -> list[Float[np.ndarray, "3"]]:
    """Return for each edge of a panel (right, left, lower, upper) the distance that it requires,
    per metre of a point's place."""
    room = ROOM * height
    beside = width / 2 - room
    below, above = height / 2 - room, height / 2 - room - strip_height(width, height)
    sides = ((axes[0], beside), (-axes[0], beside), (axes[1], below), (-axes[1], above))
    return [FOCAL * height / max(pixels, 1.0) * outward - axes[2] for outward, pixels in sides]


def _axes(azimuth_deg: float) -> Float[np.ndarray, "3 3"]:
    """Return the rows right, down, forward of a camera that looks down by `PITCH`."""
    angle = np.radians(azimuth_deg)
    outward = np.array([np.cos(angle), np.sin(angle), 0.0])
    forward = -np.cos(PITCH) * outward - [0.0, 0.0, np.sin(PITCH)]
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(forward, right), forward])
