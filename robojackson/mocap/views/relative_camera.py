"""The pose of a second camera, calibrated by the person that both cameras see.

The bodies of the two cameras, in metres, give the initial rotation and shift. Then the images
refine them: the rays of a joint meet (Sampson's distance to the epipolar line) and bones keep their
lengths, in eight unknowns of pose and focal lengths, and one of time. The distance between the
cameras is scaled so that the person is as large as in the first camera alone. x_2 = R x_1 + t;
metres, seconds.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from jaxtyping import Float, Int
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from robojackson.body.forward_kinematics import kabsch
from robojackson.errors import ViewsDisagree
from robojackson.mocap.landmarks.refinement import BONES, ORDER

FOCAL_SD, GUESS_SD, LATE_SD_S = 0.1, 0.35, 0.03
"""Spreads of the logarithm of a guessed focal length, of the guessed rotation and direction of the
shift (radians), and of the time offset."""
RAY_SD = 0.006
"""Error of a detected joint, share of the focal length."""
BONE_SD = 0.1
"""Error of a triangulated bone's length, share of its length."""
NEAREST_M = 0.05
"""Least distance between the cameras: below it no depth comes from where their rays meet."""
REPEATED = 5.0
"""Square root of the number of joints and frames with correlated errors."""


@dataclass(frozen=True)
class RelativeCamera:
    """The second camera relative to the first.

    Attributes:
        rotation, shift: x_2 = rotation @ x_1 + shift.
        focal: Focal lengths over the guessed ones.
        late_s: How much later than assumed the second clip shows a moment.
    """

    rotation: Float[np.ndarray, "3 3"]
    shift: Float[np.ndarray, "3"]
    focal: tuple[float, float]
    late_s: float = 0.0

    def to_second(self, points: Float[np.ndarray, "*T 3"]) -> Float[np.ndarray, "*T 3"]:
        """Return points of the first camera's frame in the second's."""
        return np.asarray(points @ self.rotation.T + self.shift)


def calibrate(
    one: Float[np.ndarray, "T 12 3"],
    two: Float[np.ndarray, "T 12 3"],
    trust: Float[np.ndarray, "T 12"],
    frames: Int[np.ndarray, " T"],
    fps: float,
) -> RelativeCamera:
    """Fit the second camera to both cameras' bodies at the same moments.

    Args:
        one, two: Body before each camera with its guessed focal length, metres.
        trust: Least visibility of each joint in both cameras, 0..1.
        frames: Number of each moment's frame, ascending; there may be gaps.
        fps: Frames a second.
    Raises:
        ViewsDisagree: both cameras are at one place.
    """
    rotation, shift = first_guess(one, two, trust)
    if not np.linalg.norm(shift) > NEAREST_M:
        raise ViewsDisagree(
            f"both clips are filmed from one place, within {100 * NEAREST_M:.0f} cm: give one clip "
            "alone, or two from different sides"
        )
    rays = [points[..., :2] / points[..., 2:] for points in (one, two)]
    speed = _speeds(rays[1], frames) * fps
    root = np.sqrt(trust).reshape(-1)

    def seen(x: np.ndarray) -> tuple[RelativeCamera, tuple[np.ndarray, np.ndarray]]:
        focal = (float(np.exp(x[6])), float(np.exp(x[7])))
        turned, direction = (Rotation.from_rotvec(x[k : k + 3]).as_matrix() for k in (0, 3))
        camera = RelativeCamera(turned @ rotation, direction @ shift, focal, float(x[8]))
        return camera, (rays[0] / focal[0], (rays[1] + x[8] * speed) / focal[1])

    def misses(x: np.ndarray) -> np.ndarray:
        camera, found = seen(x)
        off = sampson(camera, *found).reshape(-1) * np.sqrt(np.prod(camera.focal)) / RAY_SD
        meet = root * np.sqrt(2.0 * (np.sqrt(1.0 + off**2) - 1.0))
        bones = np.log(lengths(triangulate(camera, found)) + 1e-6)
        bones = np.arctan((bones - np.median(bones, axis=0)) / BONE_SD).reshape(-1)
        prior = [x[:6] / GUESS_SD, x[6:8] / FOCAL_SD, x[8:] / LATE_SD_S]
        return np.concatenate([meet / REPEATED, bones / REPEATED, *prior])

    camera, found = seen(least_squares(misses, np.zeros(9)).x)
    size = np.median(lengths(one) / np.maximum(lengths(triangulate(camera, found)), 1e-6))
    return RelativeCamera(camera.rotation, camera.shift * float(size), camera.focal, camera.late_s)


def _speeds(
    rays: Float[np.ndarray, "T N 2"], frames: Int[np.ndarray, " T"]
) -> Float[np.ndarray, "T N 2"]:
    """Return the change a frame within each run of consecutive frames; zero for a single one."""
    speed, ends = np.zeros_like(rays), np.flatnonzero(np.diff(frames) != 1) + 1
    for first, past in pairwise([0, *ends, len(frames)]):
        if past - first > 1:
            speed[first:past] = np.gradient(rays[first:past], axis=0)
    return speed


def first_guess(
    one: Float[np.ndarray, "T N 3"],
    two: Float[np.ndarray, "T N 3"],
    trust: Float[np.ndarray, "T N"],
) -> tuple[Float[np.ndarray, "3 3"], Float[np.ndarray, "3"]]:
    """Return the rotation and the shift of one camera's body onto the other's."""
    weight = trust[..., None]

    def centred(points: np.ndarray) -> np.ndarray:
        middle = (points * weight).sum(1, keepdims=True) / weight.sum(1, keepdims=True)
        return np.asarray((points - middle) * weight).reshape(-1, 3)

    rotation = kabsch(centred(one), centred(two))
    return rotation, np.median((two - one @ rotation.T).reshape(-1, 3), axis=0)


def sampson(
    camera: RelativeCamera, one: Float[np.ndarray, "*T 2"], two: Float[np.ndarray, "*T 2"]
) -> Float[np.ndarray, "*T"]:
    """Return the first-order distance of two rays from meeting, in units of the focal length."""
    x, y, z = camera.shift / np.linalg.norm(camera.shift)
    essential = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]]) @ camera.rotation
    left, right = (np.concatenate([r, np.ones((*r.shape[:-1], 1))], -1) for r in (one, two))
    line, back = left @ essential.T, right @ essential
    size = (line[..., :2] ** 2).sum(-1) + (back[..., :2] ** 2).sum(-1)
    return np.asarray((right * line).sum(-1) / np.sqrt(size + 1e-12))


@dataclass(frozen=True)
class DepthPrior:
    """Depths of single cameras.

    Attributes:
        depths: Depth of each point before each camera, metres.
        weight: One over their spreads, 1/m.
    """

    depths: tuple[np.ndarray, np.ndarray]
    weight: tuple[np.ndarray, np.ndarray]


def triangulate(
    camera: RelativeCamera,
    rays: tuple[Float[np.ndarray, "*T 2"], Float[np.ndarray, "*T 2"]],
    weight: tuple[np.ndarray, np.ndarray] | None = None,
    prior: DepthPrior | None = None,
) -> Float[np.ndarray, "*T 3"]:
    """Return the points, first camera's frame, that come nearest to both rays and to the depths.

    Linear least squares: x - u z = 0 and y - v z = 0 in each camera, and z = depth.
    """
    rows, goals = [], []
    cameras = ((np.eye(3), np.zeros(3)), (camera.rotation, camera.shift))
    for index, (rotation, shift) in enumerate(cameras):
        ray = rays[index]
        factor = np.ones(ray.shape[:-1]) if weight is None else weight[index]
        for axis in range(2):
            normal = rotation[axis] - ray[..., axis, None] * rotation[2]
            rows.append(normal * factor[..., None])
            goals.append((ray[..., axis] * shift[2] - shift[axis]) * factor)
        if prior is not None:
            rows.append(rotation[2] * prior.weight[index][..., None])
            goals.append((prior.depths[index] - shift[2]) * prior.weight[index])
    design, goal = np.stack(rows, -2), np.stack(goals, -1)
    normal = np.einsum("...ri,...rj->...ij", design, design) + 1e-9 * np.eye(3)
    moment = np.einsum("...ri,...r->...i", design, goal)
    return np.asarray(np.linalg.solve(normal, moment[..., None])[..., 0])


def lengths(body: Float[np.ndarray, "T 12 3"]) -> Float[np.ndarray, "T B"]:
    """Return the lengths of `BONES`, metres."""
    starts, ends = (np.array([ORDER.index(pair[k]) for pair in BONES]) for k in (0, 1))
    return np.asarray(np.linalg.norm(body[:, ends] - body[:, starts], axis=-1))
