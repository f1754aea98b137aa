"""Quaternions and rotation matrices over any batch shape.

Quaternions are wxyz and unit. Where scipy's `Rotation` serves it is used; the functions here are
those that run every control step over thousands of environments.
"""

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation


def quat_multiply(
    a: Float[np.ndarray, "*B 4"], b: Float[np.ndarray, "*B 4"]
) -> Float[np.ndarray, "*B 4"]:
    """Hamilton product a * b of quaternions wxyz."""
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
    """The inverse of a unit quaternion wxyz."""
    return q * np.array([1.0, -1.0, -1.0, -1.0])


def quat_to_matrix(q: Float[np.ndarray, "*B 4"]) -> Float[np.ndarray, "*B 3 3"]:
    """Rotation matrix of a unit quaternion wxyz."""
    w, x, y, z = np.moveaxis(q, -1, 0)
    return np.stack(
        [
            np.stack([1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)], -1),
            np.stack([2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)], -1),
            np.stack([2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)], -1),
        ],
        -2,
    )


def quat_angle(a: Float[np.ndarray, "*B 4"], b: Float[np.ndarray, "*B 4"]) -> np.ndarray:
    """Angle between two unit quaternions wxyz, radians in [0, pi]."""
    return 2.0 * np.arccos(np.clip(np.abs(np.sum(a * b, -1)), 0.0, 1.0))


def to_rotation(q: Float[np.ndarray, "*B 4"]) -> Rotation:
    """scipy Rotation of quaternions wxyz."""
    return Rotation.from_quat(q[..., [1, 2, 3, 0]])


def from_rotation(rotation: Rotation) -> Float[np.ndarray, "*B 4"]:
    """Quaternions wxyz of a scipy Rotation; the sign is scipy's."""
    return rotation.as_quat()[..., [3, 0, 1, 2]]


def sign_continuous(q: Float[np.ndarray, "T 4"]) -> Float[np.ndarray, "T 4"]:
    """The same rotations with signs chosen so that successive quaternions are nearest."""
    flips = np.where(np.sum(q[1:] * q[:-1], -1) < 0, -1.0, 1.0)
    return q * np.concatenate([[1.0], np.cumprod(flips)])[:, None]


def heading(q: Float[np.ndarray, "*B 4"]) -> np.ndarray:
    """Angle of the body's x axis about z, radians (yaw of the z-y-x decomposition)."""
    w, x, y, z = np.moveaxis(q, -1, 0)
    return np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))


def wrapped(angle: np.ndarray) -> np.ndarray:
    """The same angles in [-pi, pi), radians."""
    return np.asarray((angle + np.pi) % (2 * np.pi) - np.pi)
