"""From the detector's hip-centred metres to points before a pinhole camera of fixed focal length.

Camera frame: x right, y down, z forward, metres. BlazePose's axes are those of a camera that points
at the person; the ray through the person rotates them to the camera's. The position fits the 2D
landmarks best; across the image the 2D landmarks are then kept, in depth the detector's shape.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from robojackson.body.forward_kinematics import apply, unit
from robojackson.body.smoothing import lowpass
from robojackson.mocap.landmarks.blazepose import BODY, Landmarks

DOWN = np.array([0.0, 1.0, 0.0])
FOCAL_PER_DIAGONAL = 0.85
METRES_PER_METRE = 1.05
"""True length over BlazePose's: its bones are 0-12 % short in all clips with a ground truth."""


@dataclass(frozen=True)
class Pinhole:
    """A camera with square pixels and its axis through the middle of the image.

    Attributes:
        focal_px: Focal length, pixels.
        width, height: Size of the image, pixels.
    """

    focal_px: float
    width: int
    height: int

    def rays(self, pixels: Float[np.ndarray, "*T 2"]) -> Float[np.ndarray, "*T 2"]:
        """Return points at depth one: (x / z, y / z)."""
        return (pixels - np.array([self.width, self.height]) / 2.0) / self.focal_px

    def project(self, points: Float[np.ndarray, "*T 3"]) -> Float[np.ndarray, "*T 2"]:
        """Return pixels of points before the camera."""
        centre = np.array([self.width, self.height]) / 2.0
        result: np.ndarray = points[..., :2] / points[..., 2:] * self.focal_px + centre
        return result


def guess_focal(width: int, height: int) -> float:
    """Return a typical focal length, pixels: 0.85 of the image's diagonal.

    A phone's main camera has 0.65, the standard lens of the textbooks (and GVHMR, Shen 2024) 1.0.
    """
    return FOCAL_PER_DIAGONAL * float(np.hypot(width, height))


def place(
    landmarks: Landmarks, camera: Pinhole, fps: float, depth_cutoff_hz: float
) -> Float[np.ndarray, "T 33 3"]:
    """Return landmarks in the camera frame, metres.

    The depth of the body is smoothed with its own low cut-off: it comes from the apparent size, and
    an error of 2 % there is 6 cm at three metres.
    """
    rays = camera.rays(landmarks.image)
    local = turn_to_ray(landmarks.local * METRES_PER_METRE, rays[:, BODY].mean(1))
    root = fit_root(local[:, BODY], rays[:, BODY])
    depth = local[..., 2] + lowpass(root[:, 2:], fps, depth_cutoff_hz)
    return np.concatenate([rays * depth[..., None], depth[..., None]], -1)


def turn_to_ray(
    local: Float[np.ndarray, "T N 3"], ray: Float[np.ndarray, "T 2"]
) -> Float[np.ndarray, "T N 3"]:
    """Return points in the camera's axes from axes along the ray through the person."""
    forward = unit(np.concatenate([ray, np.ones((len(ray), 1))], -1))
    right = unit(np.cross(DOWN, forward))
    turn = np.stack([right, np.cross(forward, right), forward], -1)
    return apply(turn[:, None], local)


def fit_root(
    local: Float[np.ndarray, "T N 3"], rays: Float[np.ndarray, "T N 2"]
) -> Float[np.ndarray, "T 3"]:
    """Return the origin of the local points at which they project onto the rays.

    With x = X + t the projection x_1 - u x_3 = 0 is linear in t: t_1 - u t_3 = u X_3 - X_1, and
    likewise for v; two equations a point, least squares.
    """
    count, points = rays.shape[:2]
    design = np.zeros((count, points, 2, 3))
    design[..., 0, 0] = design[..., 1, 1] = 1.0
    design[..., 2] = -rays
    target = rays * local[..., 2:] - local[..., :2]
    normal = np.einsum("tpij,tpik->tjk", design, design)
    moment = np.einsum("tpij,tpi->tj", design, target)
    return np.linalg.solve(normal, moment[..., None])[..., 0]
