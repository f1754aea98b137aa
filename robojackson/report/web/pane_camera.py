"""Cameras of the panes of a page: each follows a body over the floor. Metres."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.ndimage import gaussian_filter1d, maximum_filter1d

from robojackson.report.video.panel_camera import smooth_camera_path
from robojackson.report.web.shapes import packed

MARGIN_M = 0.12
REACH_S = 0.6
"""How long before and after a wide pose a camera makes room for it, seconds."""
TRUNCATE = 3.0
"""Standard deviations of the filter that fit into this time, so that no pose is cut."""


@dataclass(frozen=True)
class PaneCamera:
    """What a pane shows at each picture.

    Attributes:
        target: Place on the floor that the camera looks at.
        height: Height that it shows.
        widths: Width that it shows.
    """

    target: Float[np.ndarray, "N 2"]
    height: float
    widths: Float[np.ndarray, " N"]

    @property
    def data(self) -> dict[str, object]:
        """Return the camera in JSON's types."""
        widths = packed(self.widths)
        return {"target": packed(self.target), "height": self.height, "widths": widths}


def followed(
    points: Float[np.ndarray, "N K 3"], root: Float[np.ndarray, "N 3"], fps: float
) -> PaneCamera:
    """Return a camera that shows a body as large at every picture."""
    path = smooth_camera_path(root, fps)
    widest = _widths(points, path).max()
    return PaneCamera(
        path, float(points[..., 2].max()) + 2 * MARGIN_M, np.full(len(points), widest)
    )


def followed_beside(
    points: Float[np.ndarray, "N K 3"],
    root: Float[np.ndarray, "N 3"],
    fps: float,
    other: PaneCamera,
) -> PaneCamera:
    """Return a camera that shows a body as large as another one does, and steps back where the
    body would not fit: where it lies on the floor."""
    path, reach = smooth_camera_path(root, fps), max(1, round(REACH_S * fps))
    needed = np.maximum(_widths(points, path), other.widths)
    wide = maximum_filter1d(needed, 2 * reach + 1, mode="nearest")
    smooth = gaussian_filter1d(wide, reach / TRUNCATE, mode="nearest", truncate=TRUNCATE)
    return PaneCamera(path, other.height, smooth)


def _widths(
    points: Float[np.ndarray, "N K 3"], path: Float[np.ndarray, "N 2"]
) -> Float[np.ndarray, " N"]:
    """Return the width at each picture that shows all points from every side."""
    around = np.linalg.norm(points[..., :2] - path[:, None], axis=-1).max(1)
    widths: np.ndarray = 2 * (around + MARGIN_M)
    return widths
