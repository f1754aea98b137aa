"""The recovered 3D skeleton, seen by a level camera that follows it over a grid.

World: x forward, y left, z up; metres.
"""

import numpy as np
from jaxtyping import Float, Int

from robojackson.body.skeleton import KEYPOINT_NAMES, PARENTS
from robojackson.motion.smpl_sequence import PLANTED
from robojackson.report.video import canvas
from robojackson.report.video.panel_camera import View

GRID_CELL = 0.5
GRID_REACH = 6
"""Size of a cell, metres; cells to each side."""
FEET = (("left_ankle", "left_foot"), ("right_ankle", "right_foot"))


def skeleton_panel(
    points: Float[np.ndarray, "29 3"],
    contact: Int[np.ndarray, "4"],
    view: View,
    width: int,
    height: int,
) -> canvas.Picture:
    """Return one frame: grid, shadow and bones, the far ones first.

    Args:
        points: Keypoints, world, metres.
        contact: State of heel and toe, left and right: 0 air, 1 planted, 2 sliding.
        width, height: Size of the panel, pixels.
    """
    panel = np.full((height, width, 3), canvas.BACKDROP, np.uint8)
    _draw_grid(panel, view)
    _draw_bones(panel, points * [1.0, 1.0, 0.0], view, shadow=True)
    _draw_bones(panel, points, view, shadow=False)
    _draw_contacts(panel, points, contact, view)
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


def _draw_contacts(
    panel: canvas.Picture,
    points: Float[np.ndarray, "29 3"],
    contact: Int[np.ndarray, "4"],
    view: View,
) -> None:
    """Draw a bright ring under each planted foot."""
    for side, names in enumerate(FEET):
        if (contact[2 * side : 2 * side + 2] == PLANTED).any():
            foot = np.mean([points[KEYPOINT_NAMES.index(name)] for name in names], 0)
            at = view.project(foot * [1.0, 1.0, 0.0])
            canvas.draw_dot(panel, at, (120, 230, 140), max(3, panel.shape[0] // 90))
