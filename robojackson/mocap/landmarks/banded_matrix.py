"""The normal matrix of a clip whose frames are coupled with the two before and after them."""

import numpy as np
from jaxtyping import Float


def to_bands(blocks: Float[np.ndarray, "T 36 36"]) -> np.ndarray:
    """Return the upper banded storage (scipy) of a block-diagonal symmetric matrix, with two frames
    above."""
    size = blocks.shape[1]
    above = 2 * size
    bands = np.zeros((above + 1, len(blocks) * size))
    for offset in range(size):
        values = np.zeros((len(blocks), size))
        values[:, offset:] = np.diagonal(blocks, offset, axis1=1, axis2=2)
        bands[above - offset] = values.reshape(-1)
    return bands


def add_acceleration(bands: np.ndarray, stiff: Float[np.ndarray, "T-2 36"]) -> None:
    """Add D2' W D2, which couples frames one and two apart."""
    count, size = len(stiff) + 2, stiff.shape[1]
    second = np.diff(np.eye(3), 2, axis=0)[0]
    for first, left in enumerate(second):
        for last in range(first, 3):
            columns = slice(last * size, (count - 2 + last) * size)
            bands[2 * size - (last - first) * size, columns] += (
                left * second[last] * stiff.reshape(-1)
            )
