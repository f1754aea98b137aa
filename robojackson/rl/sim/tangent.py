"""States of a robot on a free joint as vectors: sums and differences in MuJoCo's tangent space.

2 nv numbers: root position (world, m), root orientation (body, rad), hinges (rad), and the
velocities in the same order (root linear: world; angular: body). As `mj_integratePos` and
`mj_differentiatePos`, for many states at once.
"""

import numpy as np
from jaxtyping import Float

from robojackson.geometry.rotations import quat_conjugate, quat_multiply

SMALL = 1e-12


def state_plus(
    qpos: Float[np.ndarray, "*B nq"],
    qvel: Float[np.ndarray, "*B nv"],
    change: Float[np.ndarray, "*B X"],
) -> tuple[Float[np.ndarray, "*B nq"], Float[np.ndarray, "*B nv"]]:
    """Return states moved by tangent vectors; the arguments broadcast."""
    nv = qvel.shape[-1]
    moved = qpos + 0.0 * change[..., :1]
    moved[..., :3] += change[..., :3]
    moved[..., 3:7] = quat_multiply(moved[..., 3:7], _quat(change[..., 3:6]))
    moved[..., 7:] += change[..., 6:nv]
    return moved, qvel + change[..., nv:]


def state_difference(
    qpos: Float[np.ndarray, "*B nq"],
    qvel: Float[np.ndarray, "*B nv"],
    from_qpos: Float[np.ndarray, "*B nq"],
    from_qvel: Float[np.ndarray, "*B nv"],
) -> Float[np.ndarray, "*B X"]:
    """Return the tangent vectors from some states to others; the arguments broadcast."""
    turn = _vector(quat_multiply(quat_conjugate(from_qpos[..., 3:7]), qpos[..., 3:7]))
    place, hinges = qpos[..., :3] - from_qpos[..., :3], qpos[..., 7:] - from_qpos[..., 7:]
    return np.concatenate([place, turn, hinges, qvel - from_qvel], -1)


def _quat(vector: Float[np.ndarray, "*B 3"]) -> Float[np.ndarray, "*B 4"]:
    angle = np.linalg.norm(vector, axis=-1, keepdims=True)
    factor = np.where(angle > SMALL, np.sin(angle / 2) / np.maximum(angle, SMALL), 0.5)
    return np.concatenate([np.cos(angle / 2), factor * vector], -1)


def _vector(quat: Float[np.ndarray, "*B 4"]) -> Float[np.ndarray, "*B 3"]:
    quat = np.where(quat[..., :1] < 0, -quat, quat)
    sine = np.linalg.norm(quat[..., 1:], axis=-1, keepdims=True)
    angle = 2 * np.arctan2(sine, quat[..., :1])
    factor = np.where(sine > SMALL, angle / np.maximum(sine, SMALL), 2.0)
    result: np.ndarray = factor * quat[..., 1:]
    return result
