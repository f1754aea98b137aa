"""Errors of 3D joints against a truth: MPJPE, PA-MPJPE, MPJVE.

Positions in metres, in any unit that both share; the functions return the same unit.
MPJPE: Ionescu et al., Human3.6M, PAMI 2014. PA-MPJPE: after a similarity a frame (Procrustes; Gower
1975), as in Zhou et al., PAMI 2018. MPJVE: of first differences, Pavllo et al., CVPR 2019.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float


@dataclass(frozen=True)
class Similarity:
    """y = scale * rotation @ x + shift."""

    rotation: Float[np.ndarray, "*B 3 3"]
    scale: Float[np.ndarray, "*B"]
    shift: Float[np.ndarray, "*B 3"]

    def __call__(self, points: Float[np.ndarray, "*B J 3"]) -> Float[np.ndarray, "*B J 3"]:
        """Transform points."""
        turned = np.einsum("...ij,...nj->...ni", self.rotation, points)
        result: np.ndarray = self.scale[..., None, None] * turned + self.shift[..., None, :]
        return result


def procrustes(
    points: Float[np.ndarray, "*B J 3"],
    truth: Float[np.ndarray, "*B J 3"],
    scaled: bool = True,
) -> Similarity:
    """Return the similarity (or rigid motion) that maps points nearest to the truth, never a
    reflection.

    Umeyama, PAMI 1991, over any batch.
    """
    centre_x, centre_y = points.mean(-2, keepdims=True), truth.mean(-2, keepdims=True)
    x, y = points - centre_x, truth - centre_y
    left, values, right = np.linalg.svd(np.einsum("...ni,...nj->...ij", y, x))
    sign = np.sign(np.linalg.det(left @ right))
    flip = np.stack([np.ones_like(sign), np.ones_like(sign), sign], -1)
    rotation = (left * flip[..., None, :]) @ right
    power = np.maximum((x**2).sum((-1, -2)), 1e-12)
    scale = (values * flip).sum(-1) / power if scaled else np.ones_like(power)
    moved = np.einsum("...ij,...nj->...ni", rotation, centre_x)[..., 0, :]
    return Similarity(rotation, scale, centre_y[..., 0, :] - scale[..., None] * moved)


def mpjpe(points: Float[np.ndarray, "T J 3"], truth: Float[np.ndarray, "T J 3"]) -> float:
    """Return the mean distance of joints to the truth, as they are."""
    return float(np.linalg.norm(points - truth, axis=-1).mean())


def pa_mpjpe(points: Float[np.ndarray, "T J 3"], truth: Float[np.ndarray, "T J 3"]) -> float:
    """Return the mean distance after the best similarity in every frame."""
    return mpjpe(procrustes(points, truth)(points), truth)


def root_relative(
    points: Float[np.ndarray, "T J 3"], roots: Sequence[int]
) -> Float[np.ndarray, "T J 3"]:
    """Return the positions minus the mean of the root joints (the two hips) in every frame."""
    result: np.ndarray = points - points[:, list(roots)].mean(1, keepdims=True)
    return result


def align_clip(
    points: Float[np.ndarray, "T J 3"],
    truth: Float[np.ndarray, "T J 3"],
    roots: Sequence[int],
) -> Float[np.ndarray, "T J 3"]:
    """Return the root-relative points turned by ONE rotation for the whole clip, the nearest to the
    truth.

    Camera and world frames differ by a rotation that is the same in all frames; the best one over
    the clip stands for it, so that methods in different frames compare. No scale is fitted.
    """
    x, y = root_relative(points, roots), root_relative(truth, roots)
    left, _, right = np.linalg.svd(np.einsum("tni,tnj->ij", y, x))
    flip = np.array([1.0, 1.0, np.linalg.det(left @ right)])
    result: np.ndarray = x @ ((left * flip) @ right).T
    return result


def rr_mpjpe(
    points: Float[np.ndarray, "T J 3"],
    truth: Float[np.ndarray, "T J 3"],
    roots: Sequence[int],
) -> float:
    """Return the root-relative MPJPE after one rotation for the whole clip (`align_clip`)."""
    return mpjpe(align_clip(points, truth, roots), root_relative(truth, roots))


def mpjve(
    points: Float[np.ndarray, "T J 3"], truth: Float[np.ndarray, "T J 3"], fps: float
) -> float:
    """Return the mean error of joint velocities, position units a second; both in one frame of
    axes."""
    return fps * mpjpe(np.diff(points, axis=0), np.diff(truth, axis=0))
