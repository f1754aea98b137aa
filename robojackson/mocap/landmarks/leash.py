"""A bound on the refinement: the largest distance of a landmark from its detection. Metres."""

import numpy as np
from jaxtyping import Float
from scipy.ndimage import median_filter

from robojackson.mocap.landmarks.blazepose import BODY, HIPS

IN_BODY = [BODY.tolist().index(hip) for hip in HIPS]
AROUND_S = 0.15
"""Window of the median of a detection, seconds: an outlier can still be corrected."""


def leashed(
    start: Float[np.ndarray, "T 12 3"], body: Float[np.ndarray, "T 12 3"], fps: float, leash: float
) -> Float[np.ndarray, "T 12 3"]:
    """Return the body, each landmark relative to the hips at most `leash` from its detection."""
    window = max(round(AROUND_S * fps), 1) | 1
    move = _from_hips(body) - median_filter(_from_hips(start), (window, 1, 1))
    apart = np.linalg.norm(move, axis=-1, keepdims=True)
    result: np.ndarray = body - move * (1.0 - np.minimum(1.0, leash / np.maximum(apart, leash)))
    return result


def _from_hips(body: Float[np.ndarray, "T 12 3"]) -> Float[np.ndarray, "T 12 3"]:
    return np.asarray(body - body[:, IN_BODY].mean(1, keepdims=True))
