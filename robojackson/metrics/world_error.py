"""Errors of a motion in the world, path included: W-MPJPE, WA-MPJPE, RTE, and one a clip.

As Shin et al., WHAM (CVPR 2024, section 4) and Ye et al., SLAHMR (CVPR 2023): pieces of 100 frames,
a similarity for the first two frames of a piece (W) or for all of it (WA); RTE after a rigid motion
of the whole path, over its length. Metres; two frames of axes may differ by any similarity.
"""

from itertools import pairwise

import numpy as np
from jaxtyping import Float

from robojackson.metrics.pose_error import mpjpe, procrustes

SEGMENT_FRAMES = 100
"""Frames."""


def align_world(
    points: Float[np.ndarray, "T J 3"],
    truth: Float[np.ndarray, "T J 3"],
    frames: int | None = None,
    scaled: bool = True,
) -> Float[np.ndarray, "T J 3"]:
    """Return all points by ONE similarity (or rigid motion), the nearest over the first
    `frames`."""
    count = len(points) if frames is None else frames
    fit = procrustes(points[:count].reshape(-1, 3), truth[:count].reshape(-1, 3), scaled)
    return fit(points.reshape(-1, 3)).reshape(points.shape)


def w_mpjpe(points: Float[np.ndarray, "T J 3"], truth: Float[np.ndarray, "T J 3"]) -> float:
    """Return W-MPJPE: pieces of 100 frames, each aligned by its first two."""
    return _mean_over_segments(points, truth, 2)


def wa_mpjpe(points: Float[np.ndarray, "T J 3"], truth: Float[np.ndarray, "T J 3"]) -> float:
    """Return WA-MPJPE: pieces of 100 frames, each aligned as a whole."""
    return _mean_over_segments(points, truth, None)


def clip_mpjpe(points: Float[np.ndarray, "T J 3"], truth: Float[np.ndarray, "T J 3"]) -> float:
    """Return the mean distance after ONE rigid motion for the whole clip, no scale: the headline in
    metres.

    WA-MPJPE does not see a jump between two of its pieces, and shrinks a motion that has one.
    """
    return mpjpe(align_world(points, truth, scaled=False), truth)


def rte(root: Float[np.ndarray, "T 3"], truth: Float[np.ndarray, "T 3"]) -> float:
    """Return the mean error of the root's path after a rigid motion, over the length of the true
    path.

    Infinite where the true root does not move.
    """
    length = float(np.linalg.norm(np.diff(truth, axis=0), axis=-1).sum())
    error = mpjpe(align_world(root[:, None], truth[:, None], scaled=False), truth[:, None])
    return error / length if length > 0.0 else float("inf")


def _mean_over_segments(points: np.ndarray, truth: np.ndarray, frames: int | None) -> float:
    """Return the mean over all frames; a last piece too short to align joins the one before it."""
    cuts = [*range(0, max(len(points) - 1, 1), SEGMENT_FRAMES), len(points)]
    moved = [
        align_world(points[start:end], truth[start:end], frames) for start, end in pairwise(cuts)
    ]
    return mpjpe(np.concatenate(moved), truth)
