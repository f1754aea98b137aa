"""Quaternions and rotation matrices over any batch shape.

Quaternions are wxyz and unit. Where scipy's `Rotation` serves it is used; the functions here are
those that run every control step over thousands of environments.
"""

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

FIRST = np.array([10, 6, 7, 6, 5, 11, 7, 11, 5])
SECOND = np.array([15, 3, 2, 3, 15, 1, 2, 1, 10])
SIGN = np.array([1, -1, 1, 1, 1, -1, -1, 1, 1], np.float32)
FACTOR = np.array([-2, 2, 2, 2, -2, 2, 2, 2, -2], np.float32)
"""Of `quat_to_matrix`: which entries of the table of products q_i q_j (index 4 i + j) the nine
elements are made of, and how; float32, so that they leave the type of a quaternion alone."""


def quat_multiply(
    a: Float[np.ndarray, "*B 4"], b: Float[np.ndarray, "*B 4"]
) -> Float[np.ndarray, "*B 4"]:
    """Return Hamilton product a * b of quaternions wxyz."""
    aw, ax, ay, az = np.moveaxis(a, -1, 0)
    bw, bx, by, bz = np.moveaxis(b, -1, 0)
    return np.stack(
        [
            aw * bw - ax * bx - ay * by - az * bz,
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
        ],
        -1,
    )


def quat_conjugate(q: Float[np.ndarray, "*B 4"]) -> Float[np.ndarray, "*B 4"]:
    """Return the inverse of a unit quaternion wxyz."""
    result: np.ndarray = q * np.array([1.0, -1.0, -1.0, -1.0])
    return result


def quat_to_matrix(q: Float[np.ndarray, "*B 4"]) -> Float[np.ndarray, "*B 3 3"]:
    """Return the rotation matrix of a unit quaternion wxyz.

    1 - 2 (y y + z z) on the diagonal, 2 (x y - w z) beside it, and so on: of two products each, all
    taken from one table, in a few calls however small the batch is.
    """
    products = (q[..., :, None] * q[..., None, :]).reshape(*q.shape[:-1], 16)
    matrix = products[..., FIRST] + SIGN * products[..., SECOND]
    matrix *= FACTOR
    matrix[..., ::4] += 1.0
    result: np.ndarray = matrix.reshape(*q.shape[:-1], 3, 3)
    return result


def quat_angle(a: Float[np.ndarray, "*B 4"], b: Float[np.ndarray, "*B 4"]) -> np.ndarray:
    """Return the angle between two unit quaternions wxyz, radians in [0, pi]."""
    result: np.ndarray = 2.0 * np.arccos(np.clip(np.abs(np.sum(a * b, -1)), 0.0, 1.0))
    return result


def to_rotation(q: Float[np.ndarray, "*B 4"]) -> Rotation:
    """Return scipy Rotation of quaternions wxyz."""
    return Rotation.from_quat(q[..., [1, 2, 3, 0]])


def from_rotation(rotation: Rotation) -> Float[np.ndarray, "*B 4"]:
    """Return quaternions wxyz of a scipy Rotation; the sign is scipy's."""
    result: np.ndarray = rotation.as_quat()[..., [3, 0, 1, 2]]
    return result


def sign_continuous(q: Float[np.ndarray, "T 4"]) -> Float[np.ndarray, "T 4"]:
    """Return the same rotations with signs chosen so that successive quaternions are nearest."""
    flips = np.where(np.sum(q[1:] * q[:-1], -1) < 0, -1.0, 1.0)
    result: np.ndarray = q * np.concatenate([[1.0], np.cumprod(flips)])[:, None]
    return result


def heading(q: Float[np.ndarray, "*B 4"]) -> np.ndarray:
    """Return the angle of the body's x axis about z, radians (yaw of the z-y-x decomposition)."""
    w, x, y, z = np.moveaxis(q, -1, 0)
    result: np.ndarray = np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    return result


def wrapped(angle: np.ndarray) -> np.ndarray:
    """Return the same angles in [-pi, pi), radians."""
    return np.asarray((angle + np.pi) % (2 * np.pi) - np.pi)
