"""Learning curves: means of episodes over intervals of the budget, their area and threshold."""

import numpy as np
from jaxtyping import Float


def curve(
    steps: Float[np.ndarray, " E"], values: Float[np.ndarray, " E"], grid: Float[np.ndarray, " G"]
) -> Float[np.ndarray, " G-1"]:
    """Return the mean of the episodes that ended in each interval of the grid; an empty one keeps
    the last.

    Before the first episode there is no value: NaN.
    """
    place = np.searchsorted(grid, steps, side="left") - 1
    inside = (place >= 0) & (place < len(grid) - 1)
    sums = np.bincount(place[inside], values[inside], len(grid) - 1)
    counts = np.bincount(place[inside], minlength=len(grid) - 1)
    means = np.divide(sums, counts, out=np.full(len(grid) - 1, np.nan), where=counts > 0)
    known = np.maximum.accumulate(np.where(counts > 0, np.arange(len(means)), -1))
    return np.where(known >= 0, means[known], np.nan)


def area(values: Float[np.ndarray, " G"]) -> float:
    """Return the area under a curve over the whole budget, as a mean."""
    return float(np.nanmean(values)) if np.isfinite(values).any() else np.nan


def steps_to(
    grid: Float[np.ndarray, " G"], values: Float[np.ndarray, " G-1"], threshold: float
) -> float:
    """Return the steps after which the curve stays at the threshold or above; infinity if it never
    does."""
    below = np.flatnonzero(~(values >= threshold))
    if not len(below):
        return float(grid[1])
    first = int(below[-1]) + 1
    return float(grid[first + 1]) if first < len(values) else np.inf
