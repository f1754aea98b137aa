"""Forward kinematics of the 29-point tree, and rotations as swing times twist.

A local rotation R of a joint turns its rest bone t: R = swing * twist, the twist about t, the swing
the shortest way from t to its new direction (Li et al., CVPR 2021, section 3.2). Metres, radians.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from robojackson.body.skeleton import PARENTS

TINY = 1e-12


@dataclass(frozen=True)
class Pose:
    """A posed skeleton: rotations of the 24 joints to the root's frame, and the 29 points."""

    rotations: Float[np.ndarray, "T 24 3 3"]
    points: Float[np.ndarray, "T 29 3"]


def forward(
    local: Float[np.ndarray, "T 24 3 3"],
    rest_joints: Float[np.ndarray, "*T 29 3"],
    root: Float[np.ndarray, "T 3"],
) -> Pose:
    """Pose a rest skeleton; `root` is where the pelvis ends, leaves follow their parent."""
    rest = np.broadcast_to(rest_joints, (len(local), 29, 3))
    rotations = np.empty_like(local)
    points = np.empty((len(local), 29, 3))
    rotations[:, 0], points[:, 0] = local[:, 0], root
    for index, parent in enumerate(PARENTS[1:], start=1):
        offset = rest[:, index] - rest[:, parent]
        points[:, index] = points[:, parent] + apply(rotations[:, parent], offset)
        if index < local.shape[1]:
            rotations[:, index] = rotations[:, parent] @ local[:, index]
    return Pose(rotations, points)


def apply(
    rotation: Float[np.ndarray, "*T 3 3"], vector: Float[np.ndarray, "*T 3"]
) -> Float[np.ndarray, "*T 3"]:
    """Return R v over any batch."""
    result: np.ndarray = np.einsum("...ij,...j->...i", rotation, vector)
    return result


def unit(vector: Float[np.ndarray, "*T 3"]) -> Float[np.ndarray, "*T 3"]:
    """Return v / |v|; a zero vector stays zero."""
    result: np.ndarray = vector / np.maximum(np.linalg.norm(vector, axis=-1, keepdims=True), TINY)
    return result


def rotate_about(
    axis: Float[np.ndarray, "*T 3"], cosine: np.ndarray, sine: np.ndarray
) -> Float[np.ndarray, "*T 3 3"]:
    """Return the rotation about a unit axis by an angle given as (cos, sin) (Rodrigues'
    formula)."""
    x, y, z = np.moveaxis(axis, -1, 0)
    versine = 1.0 - cosine
    diagonal = cosine + versine * (1.0 - x * x - y * y - z * z)
    xs, ys, zs = x * sine, y * sine, z * sine
    xv, yv, zv = x * versine, y * versine, z * versine
    turn = np.empty((*np.broadcast_shapes(x.shape, np.shape(sine)), 3, 3))
    turn[..., 0, 0], turn[..., 0, 1], turn[..., 0, 2] = diagonal + x * xv, x * yv - zs, x * zv + ys
    turn[..., 1, 0], turn[..., 1, 1], turn[..., 1, 2] = x * yv + zs, diagonal + y * yv, y * zv - xs
    turn[..., 2, 0], turn[..., 2, 1], turn[..., 2, 2] = x * zv - ys, y * zv + xs, diagonal + z * zv
    return turn


def swing(
    start: Float[np.ndarray, "*T 3"], end: Float[np.ndarray, "*T 3"]
) -> Float[np.ndarray, "*T 3 3"]:
    """Return the shortest rotation from the direction of `start` to that of `end`.

    Opposite directions turn by pi about any normal; a zero vector turns nothing.
    """
    a, b = np.broadcast_arrays(unit(start), unit(end))
    normal = np.cross(a, b)
    sine = np.linalg.norm(normal, axis=-1)
    cosine = np.sum(a * b, -1)
    opposite = (sine < 1e-9) & (cosine < 0.0)
    axis = np.where(opposite[..., None], any_normal(a), unit(normal))
    return rotate_about(axis, np.where(sine + np.abs(cosine) < TINY, 1.0, cosine), sine)


def any_normal(vector: Float[np.ndarray, "*T 3"]) -> Float[np.ndarray, "*T 3"]:
    """Return a unit vector at right angles: the cross product with the least aligned axis."""
    least = np.eye(3)[np.argmin(np.abs(vector), axis=-1)]
    return unit(np.cross(vector, least))


def twist(
    bone: Float[np.ndarray, "*T 3"], cos_sin: Float[np.ndarray, "*T 2"]
) -> Float[np.ndarray, "*T 3 3"]:
    """Return the rotation about a rest bone by (cos, sin), which need not have length one."""
    length = np.linalg.norm(cos_sin, axis=-1, keepdims=True)
    unit_pair = np.where(length > TINY, cos_sin / np.maximum(length, TINY), [1.0, 0.0])
    return rotate_about(unit(bone), unit_pair[..., 0], unit_pair[..., 1])


def split(
    rotation: Float[np.ndarray, "*T 3 3"], bone: Float[np.ndarray, "*T 3"]
) -> tuple[Float[np.ndarray, "*T 3 3"], Float[np.ndarray, "*T 2"]]:
    """Return the swing and the (cos, sin) of the twist whose product is the rotation."""
    swung = swing(bone, apply(rotation, bone))
    turned = np.swapaxes(swung, -1, -2) @ rotation
    axis = unit(bone)
    side = any_normal(np.broadcast_to(axis, (*rotation.shape[:-2], 3)))
    moved = apply(turned, side)
    cosine = np.sum(side * moved, -1)
    sine = np.sum(np.cross(side, moved) * axis, -1)
    return swung, np.stack([cosine, sine], -1)


def triad(
    primary: Float[np.ndarray, "*T 3"], secondary: Float[np.ndarray, "*T 3"]
) -> Float[np.ndarray, "*T 3 3"]:
    """Return orthonormal columns: the first along `primary`, the third normal to both (TRIAD,
    1964)."""
    first = unit(primary)
    third = unit(np.cross(first, secondary))
    return np.stack([first, np.cross(third, first), third], -1)


def align(
    rest: tuple[np.ndarray, np.ndarray], posed: tuple[np.ndarray, np.ndarray]
) -> Float[np.ndarray, "*T 3 3"]:
    """Return the rotation that takes the primary rest vector to the posed one and keeps the half
    plane."""
    result: np.ndarray = triad(*posed) @ np.swapaxes(triad(*rest), -1, -2)
    return result


def kabsch(
    rest: Float[np.ndarray, "*T N 3"], posed: Float[np.ndarray, "*T N 3"]
) -> Float[np.ndarray, "*T 3 3"]:
    """Return the least-squares rotation from rest to posed vectors (Kabsch 1976), never a
    reflection."""
    spread = np.einsum("...ni,...nj->...ij", rest, posed)
    left, _, right = np.linalg.svd(spread)
    sign = np.linalg.det(np.swapaxes(right, -1, -2) @ np.swapaxes(left, -1, -2))
    right = right.copy()
    right[..., 2, :] *= sign[..., None]
    return np.swapaxes(left @ right, -1, -2)
