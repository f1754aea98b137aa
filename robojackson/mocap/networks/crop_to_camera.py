"""From the crop's (u, v, d) to metres before the camera.

HybrIK assumes for every crop a lens of 1000 pixels at 256: in the image that is a focal length that
changes with the box. `refocus` places the person before one fixed lens. Camera frame: x right, y
down, z forward, metres.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from robojackson.body import analytic_solve
from robojackson.body.forward_kinematics import forward
from robojackson.body.smoothing import lowpass
from robojackson.mocap.landmarks.pinhole_camera import Pinhole
from robojackson.mocap.networks.person_crop import SIDE_PX

FOCAL_PX = 1000.0
"""Side of the crop, pixels."""
DEPTH_M = 2.2
"""Depth from d = -0.5 to d = 0.5, metres."""
DOUBT_FACTOR = 10.0
"""Largest sigma of a keypoint that is used to refine the scale."""
LEAST_SCALE, LARGEST_SCALE = 0.05, 5.0
"""Plausible scales: of crops between 20 m and 0.2 m."""
TINY = 1e-9


@dataclass(frozen=True)
class View:
    """Positions of a clip's crops in the image.

    Attributes:
        boxes: Centre x, centre y and side, pixels.
        width, height: Size of the image, pixels.
    """

    boxes: Float[np.ndarray, "T 3"]
    width: int
    height: int

    @property
    def offset(self) -> Float[np.ndarray, "T 2"]:
        """Return the offset from the image's middle to the crop's, in sides of the crop."""
        middle = np.array([self.width, self.height]) / 2.0
        result: np.ndarray = (self.boxes[:, :2] - middle) / self.boxes[:, 2:]
        return result

    @property
    def focal_px(self) -> Float[np.ndarray, " T"]:
        """Return HybrIK's focal length of each frame in pixels of the image."""
        return FOCAL_PX / SIDE_PX * self.boxes[:, 2]


def lift(
    uvd: Float[np.ndarray, "T J 3"], scale: Float[np.ndarray, " T"], view: View
) -> Float[np.ndarray, "T J 3"]:
    """Return points before the camera of each frame's own focal length.

    Z = 2.2 d + 1000 / (256 s);  (X, Y) = (uv + offset) 256 / 1000 Z.
    """
    depth = FOCAL_PX / (SIDE_PX * np.asarray(scale) + TINY)
    z = DEPTH_M * uvd[..., 2:] + depth[:, None, None]
    xy = (uvd[..., :2] + view.offset[:, None]) * (SIDE_PX / FOCAL_PX) * z
    return np.concatenate([xy, z], -1)


def refine_scale(
    uvd: Float[np.ndarray, "T 29 3"],
    scale: Float[np.ndarray, " T"],
    sigma: Float[np.ndarray, "T 29"],
    twist: Float[np.ndarray, "T 23 2"],
    rest_joints: Float[np.ndarray, "*T 29 3"],
    view: View,
) -> Float[np.ndarray, " T"]:
    """Return the scale at which the solved person, with his own bones, projects onto the observed
    (u, v).

    With X the solved joints about the observed pelvis, X - 256/1000 (uv) X_z = (uv) / s is linear
    in a = 1 / s: least squares over 24 joints in x and y, weighted by max(0, 1 - 10 sigma). Frames
    without a solution keep their scale.
    """
    points = lift(uvd, scale, view)
    local = analytic_solve.solve(points - points[:, :1], rest_joints, twist, "naive")
    depth = FOCAL_PX / (SIDE_PX * scale + TINY)
    root = points[:, 0] - np.outer(depth, [0.0, 0.0, 1.0])
    joints = forward(local, rest_joints, root).points[:, :24]
    uv = uvd[:, :24, :2] + view.offset[:, None]
    weight = np.maximum(0.0, 1.0 - DOUBT_FACTOR * sigma[:, :24, None])
    left = joints[..., :2] - SIDE_PX / FOCAL_PX * uv * joints[..., 2:]
    across = np.sum((weight * uv) ** 2, (1, 2))
    inverse = np.sum(weight**2 * uv * left, (1, 2)) / np.maximum(across, TINY)
    refined = 1.0 / np.where(np.abs(inverse) < TINY, np.inf, inverse)
    sound = (refined > LEAST_SCALE) & (refined < LARGEST_SCALE)
    return np.where(sound, refined, scale)


def refocus(
    points: Float[np.ndarray, "T J 3"],
    view: View,
    camera: Pinhole,
    fps: float,
    depth_cutoff_hz: float,
) -> Float[np.ndarray, "T J 3"]:
    """Return the same shapes before one camera of fixed focal length.

    The pelvis moves from Z to Z f / f_frame, which keeps its size in the image; the smoothed depth
    and the ray through the observed pelvis give its position.
    """
    root = points[:, 0]
    ray = root[:, :2] / root[:, 2:] * view.focal_px[:, None] / camera.focal_px
    depth = lowpass(root[:, 2:] * camera.focal_px / view.focal_px[:, None], fps, depth_cutoff_hz)
    place = np.concatenate([ray * depth, depth], -1)
    result: np.ndarray = points - root[:, None] + place[:, None]
    return result
