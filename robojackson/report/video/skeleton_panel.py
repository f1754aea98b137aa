"""The recovered 3D skeleton, seen by a level camera of our own that follows it over a grid.

World: x forward, y left, z up; metres. The camera stands on the +x side, as the one that filmed.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.ndimage import gaussian_filter1d

from robojackson.body.skeleton import KEYPOINT_NAMES, PARENTS
from robojackson.motion.smpl_sequence import PLANTED, SmplSequence
from robojackson.report.video import canvas

GRID_CELL = 0.5
GRID_REACH = 6
"""Metres; cells to each side."""
FOCAL = 2.2
"""Focal length over the height of the panel."""
DISTANCE, CAMERA_HEIGHT, LOOK_AT_HEIGHT = 5.0, 1.35, 0.9
NEAR = 0.3
"""Metres."""
SMOOTHING_S = 0.5
"""How gently a camera follows, seconds."""
FEET = (("left_ankle", "left_foot"), ("right_ankle", "right_foot"))


@dataclass(frozen=True)
class View:
    """A pinhole camera.

    Attributes:
        target: Where on the floor it looks, metres.
        eye: Position, world, metres.
        axes: Rows right, down, forward, world.
        focal: Pixels.
        centre: Of the image, pixels.
    """

    target: Float[np.ndarray, "2"]
    eye: Float[np.ndarray, "3"]
    axes: Float[np.ndarray, "3 3"]
    focal: float
    centre: tuple[float, float]

    def project(self, points: Float[np.ndarray, "*B 3"]) -> Float[np.ndarray, "*B 2"]:
        """Pixels; NaN behind the camera."""
        right, down, depth = np.moveaxis((points - self.eye) @ self.axes.T, -1, 0)
        depth = np.where(depth > NEAR, depth, np.nan)
        u = self.centre[0] + self.focal * right / depth
        return np.stack([u, self.centre[1] + self.focal * down / depth], -1)


def smooth_camera_path(points: Float[np.ndarray, "T 3"], fps: float) -> Float[np.ndarray, "T 2"]:
    """Where on the floor a camera looks that follows a point gently."""
    result: np.ndarray = gaussian_filter1d(points[:, :2], SMOOTHING_S * fps, axis=0, mode="nearest")
    return result


def view_of(target: Float[np.ndarray, "2"], azimuth_deg: float, width: int, height: int) -> View:
    """The camera that looks at a place on the floor; azimuth 0 stands on the +x side."""
    angle = np.radians(azimuth_deg)
    outward = np.array([np.cos(angle), np.sin(angle), 0.0])
    aim = np.array([*target, LOOK_AT_HEIGHT])
    eye = np.array([*target, CAMERA_HEIGHT]) + DISTANCE * outward
    forward = (aim - eye) / np.linalg.norm(aim - eye)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    axes = np.stack([right, np.cross(forward, right), forward])
    return View(target, eye, axes, FOCAL * height, (width / 2, height / 2))


def skeleton_panel(
    sequence: SmplSequence, frame: int, view: View, width: int, height: int
) -> canvas.Picture:
    """One frame: grid, shadow and bones, the far ones first."""
    panel = np.full((height, width, 3), canvas.BACKDROP, np.uint8)
    _draw_grid(panel, view)
    points = sequence.keypoints_w[frame]
    _draw_bones(panel, points * [1.0, 1.0, 0.0], view, shadow=True)
    _draw_bones(panel, points, view, shadow=False)
    _draw_contacts(panel, sequence, frame, view)
    return panel


def _draw_grid(panel: canvas.Picture, view: View) -> None:
    middle = np.round(view.target / GRID_CELL) * GRID_CELL
    ticks = np.arange(-GRID_REACH, GRID_REACH + 1) * GRID_CELL
    for tick in ticks:
        for line in ([[tick, ticks[0]], [tick, ticks[-1]]], [[ticks[0], tick], [ticks[-1], tick]]):
            ends = np.column_stack([np.array(line) + middle, np.zeros(2)])
            a, b = view.project(ends)
            canvas.draw_line(panel, a, b, canvas.GRID, 1)


def _draw_bones(
    panel: canvas.Picture, points: Float[np.ndarray, "29 3"], view: View, shadow: bool
) -> None:
    pixels = view.project(points)
    depth = (points - view.eye) @ view.axes[2]
    width = max(2, panel.shape[0] // 110)
    bones = [(i, p) for i, p in enumerate(PARENTS) if p >= 0]
    for child, parent in sorted(bones, key=lambda bone: -depth[bone[0]] - depth[bone[1]]):
        colour = (14, 16, 21) if shadow else canvas.side_colour(KEYPOINT_NAMES[child])
        canvas.draw_line(panel, pixels[parent], pixels[child], colour, width)
        if not shadow:
            canvas.draw_dot(panel, pixels[child], colour, width // 2 + 1)


def _draw_contacts(panel: canvas.Picture, sequence: SmplSequence, frame: int, view: View) -> None:
    """A ring of light under each foot that stands."""
    for side, names in enumerate(FEET):
        states = sequence.contact[frame, 2 * side : 2 * side + 2]
        if (states == PLANTED).any():
            foot = np.mean([sequence.keypoints_w[frame, KEYPOINT_NAMES.index(n)] for n in names], 0)
            at = view.project(foot * [1.0, 1.0, 0.0])
            canvas.draw_dot(panel, at, (120, 230, 140), max(3, panel.shape[0] // 90))
