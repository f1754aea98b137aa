"""Uncertainty of the whole-clip refinement for each joint: covariances from its normal matrix.

At the solution the inverse of the normal matrix is the covariance of all joints in all frames
(Laplace). It is banded, frames are coupled with the two before and after, so its diagonal blocks
follow from one pass forward and one back over pairs of frames (Rybicki and Hummer 1991). A joint's
confidence is the probability that it is within `NEAR_M` of the estimate, relative to the hips.
"""

import numpy as np
from jaxtyping import Float

from robojackson.mocap.landmarks.blazepose import BODY, LANDMARK_NAMES
from robojackson.mocap.landmarks.refinement import (
    HIPS,
    ORDER,
    SIZE,
    Evidence,
    RefineConfig,
    residuals,
    stiffness,
)

NEAR_M = 0.15
REPEATED_S = 0.2
"""Correlation time of errors: a variance is multiplied by the number of frames in it. Measured on
the eight tuned clips: the mean confidence is .77, and .84 of their joints are near."""
HANGS_ON = {
    "pinky": "wrist", "index": "wrist", "thumb": "wrist", "heel": "ankle", "foot_index": "ankle",
}  # fmt: skip


def certainty(
    body: Float[np.ndarray, "T 12 3"],
    evidence: Evidence,
    visibility: Float[np.ndarray, "T 33"],
    config: RefineConfig,
) -> Float[np.ndarray, "T 33"]:
    """Return the confidence 0..1 of all landmarks; unrefined ones get that of their carrier.

    Args:
        body: The refined landmarks, metres, camera.
        evidence: Measurements that they were refined from.
        visibility: Visibility of the landmarks, an upper bound for face, hands and feet.
        config: Settings of the refinement.
    """
    from scipy.stats import chi2

    variance = root_relative(covariances(body, evidence, config))
    near = chi2.cdf(NEAR_M**2 / (variance * max(1.0, REPEATED_S * evidence.fps)), df=3)
    sure = np.array(visibility)
    sure[:, BODY] = near
    for index, name in enumerate(LANDMARK_NAMES):
        side, _, part = name.partition("_")
        if part in HANGS_ON:
            sure[:, index] *= near[:, ORDER.index(f"{side}_{HANGS_ON[part]}")]
    return np.asarray(np.clip(sure, 0.0, 1.0))


def covariances(
    body: Float[np.ndarray, "T 12 3"], evidence: Evidence, config: RefineConfig
) -> Float[np.ndarray, "T 36 36"]:
    """Return the covariance of the joints of each frame, given the whole clip."""
    jacobian, _ = residuals(body, evidence, config)
    normal = np.einsum("tri,trj->tij", jacobian, jacobian)
    count = len(normal) + len(normal) % 2
    coupling = _second_difference(stiffness(body, evidence.fps, config), count)
    blocks = np.zeros((count, SIZE, SIZE))
    blocks[: len(normal)] = normal
    blocks[len(normal) :] = np.eye(SIZE)
    blocks += np.eye(SIZE) * coupling[0][:, None]
    return _diagonal_of_inverse(*_paired(blocks, coupling))[: len(normal)]


def root_relative(covariance: Float[np.ndarray, "T 36 36"]) -> Float[np.ndarray, "T 12"]:
    """Return the mean variance of the three axes of each joint minus the middle of the hips,
    m^2."""
    each = np.eye(len(ORDER))
    each[:, HIPS] -= 0.5
    blocks = covariance.reshape(len(covariance), len(ORDER), 3, len(ORDER), 3)
    traces = np.einsum("tiaja->tij", blocks)
    result: np.ndarray = np.einsum("ki,tij,kj->tk", each, traces, each) / 3.0
    return result


def _second_difference(stiff: Float[np.ndarray, "S 36"], count: int) -> Float[np.ndarray, "3 T 36"]:
    """Return diagonals 0, 1 and 2 of D2' W D2 over two frames more than weights, padded with
    zeros."""
    second = np.array([1.0, -2.0, 1.0])
    diagonals = np.zeros((3, count, SIZE))
    frames = len(stiff) + 2
    for start in range(3):
        for apart in range(3 - start):
            product = second[start] * second[start + apart]
            diagonals[apart, start : frames - 2 + start] += product * stiff
    return diagonals


def _paired(blocks: np.ndarray, coupling: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the block tridiagonal form over pairs of frames: diagonal blocks, and those above
    them."""
    pairs, eye = len(blocks) // 2, np.eye(SIZE)
    one, two = (coupling[apart][:, None] * eye for apart in (1, 2))
    diagonal = np.zeros((pairs, 2, SIZE, 2, SIZE))
    diagonal[:, 0, :, 0], diagonal[:, 1, :, 1] = blocks[0::2], blocks[1::2]
    diagonal[:, 0, :, 1] = diagonal[:, 1, :, 0] = one[0::2]
    above = np.zeros((pairs, 2, SIZE, 2, SIZE))
    above[:, 0, :, 0] = two[0::2]
    above[:, 1, :, 0] = one[1::2]
    above[:, 1, :, 1] = two[1::2]
    return diagonal.reshape(pairs, 2 * SIZE, -1), above.reshape(pairs, 2 * SIZE, -1)


def _diagonal_of_inverse(diagonal: np.ndarray, above: np.ndarray) -> Float[np.ndarray, "T 36 36"]:
    """Return blocks of one frame on the diagonal of the inverse of a block tridiagonal matrix."""
    inverse = np.empty_like(diagonal)
    gain = np.empty_like(diagonal)
    inverse[0] = np.linalg.inv(diagonal[0])
    for k in range(1, len(diagonal)):
        gain[k - 1] = inverse[k - 1] @ above[k - 1]
        inverse[k] = np.linalg.inv(diagonal[k] - above[k - 1].T @ gain[k - 1])
    for k in range(len(diagonal) - 2, -1, -1):
        inverse[k] += gain[k] @ inverse[k + 1] @ gain[k].T
    halves = inverse.reshape(len(diagonal), 2, SIZE, 2, SIZE)
    return np.stack([halves[:, 0, :, 0], halves[:, 1, :, 1]], 1).reshape(-1, SIZE, SIZE)
