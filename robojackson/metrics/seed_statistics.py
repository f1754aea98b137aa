"""Means over seeds with intervals, and the effect of one setup against another, seeds paired.

A seed is one sample; rollouts of one policy are not. Intervals: percentile bootstrap over seeds
(Efron 1979); paired effects: exact sign-flip permutation test (Fisher 1935); probability of
improvement: Agarwal et al., "Deep RL at the edge of the statistical precipice", 2021, equation of
section 4.3. All of them from scipy.stats.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy import stats

LEVEL = 0.95
RESAMPLES = 9_999
MOST_EXACT = 18
"""Pairs up to which all sign flips are looked at."""


@dataclass(frozen=True)
class Estimate:
    """A mean over seeds.

    Attributes:
        mean: Mean of the samples that are finite; infinite where there are others only.
        low, high: Ends of the 95 % interval; NaN with fewer than two such samples.
        count: Samples that are finite.
    """

    mean: float
    low: float
    high: float
    count: int


@dataclass(frozen=True)
class Effect:
    """One setup against another, seeds paired.

    Attributes:
        difference: Mean of treated minus control, with its interval.
        p: Two-sided, of the exact sign-flip test; NaN with fewer than two pairs.
        smallest_p: The smallest p that this number of pairs can give.
        improvement: Probability that a run of the treated beats one of the control.
    """

    difference: Estimate
    p: float
    smallest_p: float
    improvement: float


def estimate(samples: Sequence[float], rng: np.random.Generator) -> Estimate:
    """Return the mean and percentile-bootstrap interval of the finite ones of independent
    samples."""
    numbers = np.asarray(samples, float)
    values = numbers[np.isfinite(numbers)]
    if len(values) < 2:
        beyond = np.inf if np.isinf(numbers).any() else np.nan
        return Estimate(float(values[0]) if len(values) else beyond, np.nan, np.nan, len(values))
    if np.ptp(values) == 0:
        return Estimate(float(values[0]), float(values[0]), float(values[0]), len(values))
    found = stats.bootstrap(
        (values,), np.mean, confidence_level=LEVEL, n_resamples=RESAMPLES, method="percentile",
        rng=rng,
    ).confidence_interval  # fmt: skip
    return Estimate(float(values.mean()), float(found.low), float(found.high), len(values))


def effect(treated: Sequence[float], control: Sequence[float], rng: np.random.Generator) -> Effect:
    """Return how much better the treated are, pair by pair; one without a figure, or with one
    beyond all measure, counts in the number of its kind alone.

    Raises:
        ValueError: the samples are not pairs.
    """
    first, second = np.asarray(treated, float), np.asarray(control, float)
    if len(first) != len(second):
        raise ValueError(f"{len(first)} treated and {len(second)} control samples are no pairs")
    with np.errstate(invalid="ignore"):
        differences = first - second
    known = np.isfinite(differences)
    first, second, p = first[known], second[known], np.nan
    if len(first) > 1:
        p = stats.permutation_test(
            (first - second,), np.mean, permutation_type="samples", n_resamples=_flips(len(first)),
            rng=rng,
        ).pvalue  # fmt: skip
    difference = estimate(list(differences), rng)
    smallest = max(2.0 ** (1 - len(first)), 2.0 / _flips(len(first))) if len(first) else np.nan
    return Effect(difference, float(p), smallest, probability_of_improvement(first, second))


def _flips(pairs: int) -> int:
    """Return the number of sign flips of a test: all of them up to `MOST_EXACT` pairs."""
    return max(RESAMPLES, 1 << min(pairs, MOST_EXACT))


def probability_of_improvement(
    first: Float[np.ndarray, " N"], second: Float[np.ndarray, " M"]
) -> float:
    """Return the share of pairs (x, y) with x > y, ties counted half (Mann and Whitney's U over N
    M)."""
    if not len(first) or not len(second):
        return np.nan
    return float(stats.mannwhitneyu(first, second).statistic) / (len(first) * len(second))
