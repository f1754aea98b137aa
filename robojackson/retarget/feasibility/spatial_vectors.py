"""Spatial vectors of many links and steps at once (Featherstone, 2008), angular part first.

Components stand first and steps last, so that every operation runs over contiguous numbers.
"""

import numpy as np

Vector = np.ndarray
"""Three components, then dofs or bodies, then steps."""
Pair = tuple[Vector, Vector]
"""Angular and linear part of a motion, or moment and force."""


def dot(a: Vector, b: Vector) -> np.ndarray:
    """Return the scalar products."""
    return np.asarray(a[0] * b[0] + a[1] * b[1] + a[2] * b[2])


def apply(matrix: np.ndarray, vector: Vector) -> Vector:
    """Return matrices (3, 3, ...) times vectors."""
    return np.stack([dot(row, vector) for row in matrix])


def product(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the products of matrices (3, 3, ...)."""
    return np.stack([apply(a, b[:, k]) for k in range(3)], axis=1)


def add_diagonal(matrix: np.ndarray, value: np.ndarray) -> None:
    """Add a value to the diagonals of matrices, in place."""
    for k in range(3):
        matrix[k, k] += value


def cross(a: Vector, b: Vector) -> Vector:
    """Cross products."""
    return np.stack(
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    )


def added(a: Pair, b: Pair) -> Pair:
    """Return the sums of motions or of forces."""
    return a[0] + b[0], a[1] + b[1]


def cross_motion(v: Pair, x: Pair) -> Pair:
    """Return v x x of motions."""
    return cross(v[0], x[0]), cross(v[0], x[1]) + cross(v[1], x[0])


def cross_force(v: Pair, f: Pair) -> Pair:
    """Return v x* f of a motion and a force."""
    return cross(v[0], f[0]) + cross(v[1], f[1]), cross(v[0], f[1])
