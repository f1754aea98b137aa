"""Shares by which one pose becomes another."""

import numpy as np
from jaxtyping import Float


def minimum_jerk(share: Float[np.ndarray, "*N"]) -> Float[np.ndarray, "*N"]:
    """Return the shares of a way from rest to rest (Flash and Hogan, 1985).

    Args:
        share: Share of the time, from 0 to 1.
    """
    return np.asarray(share**3 * (10 - 15 * share + 6 * share**2))
