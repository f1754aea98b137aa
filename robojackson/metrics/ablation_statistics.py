"""What an ablation shows: learning curves, intervals over seeds, paired effects, three claims.

A seed is one sample; rollouts of one policy are not. Intervals: percentile bootstrap over seeds
(Efron 1979); paired effects: exact sign-flip permutation test (Fisher 1935); probability of
improvement: Agarwal et al., "Deep RL at the edge of the statistical precipice", 2021, equation of
section 4.3. All of them from scipy.stats; nothing here knows where tables are kept.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Float
from scipy import stats

LEVEL = 0.95
RESAMPLES = 9_999
COMPARED = (
    ("pretrain", "scratch"),
    ("curiosity", "scratch-curiosity"),
    ("scratch-curiosity", "scratch"),
    ("curiosity", "pretrain"),
)
"""Setups that differ in one thing: twice in pretraining, twice in curiosity."""
Verdict = Literal["holds", "not shown", "reversed", "not measured"]


@dataclass(frozen=True)
class Estimate:
    """A mean over seeds.

    Attributes:
        mean: Of the samples that are finite; infinite where there are others only.
        low, high: Of the 95 % interval; NaN with fewer than two such samples.
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
        smallest_p: The smallest that so many pairs can give.
        improvement: Probability that a run of the treated beats one of the control.
    """

    difference: Estimate
    p: float
    smallest_p: float
    improvement: float


@dataclass(frozen=True)
class Claim:
    """One sentence of the paper, and what was found.

    Attributes:
        text: What it says.
        treated, control: Setups that are compared.
        expected: 1 when the treated should be better, -1 when worse.
        verdict: `holds` and `reversed` only where the interval of the effect leaves out zero.
        effect: None where it was not measured.
    """

    text: str
    treated: str
    control: str
    expected: int
    verdict: Verdict
    effect: Effect | None


@dataclass(frozen=True)
class Comparison:
    """One setup against another, move by move.

    Attributes:
        treated, control: Setups that are compared.
        effects: By move; None where it was not measured.
    """

    treated: str
    control: str
    effects: Mapping[str, Effect | None]


def estimate(samples: Sequence[float], rng: np.random.Generator) -> Estimate:
    """Mean and percentile-bootstrap interval of the finite ones of independent samples."""
    told = np.asarray(samples, float)
    values = told[np.isfinite(told)]
    if len(values) < 2:
        beyond = np.inf if np.isinf(told).any() else np.nan
        return Estimate(float(values[0]) if len(values) else beyond, np.nan, np.nan, len(values))
    if np.ptp(values) == 0:
        return Estimate(float(values[0]), float(values[0]), float(values[0]), len(values))
    found = stats.bootstrap(
        (values,), np.mean, confidence_level=LEVEL, n_resamples=RESAMPLES, method="percentile",
        rng=rng,
    ).confidence_interval  # fmt: skip
    return Estimate(float(values.mean()), float(found.low), float(found.high), len(values))


def effect(treated: Sequence[float], control: Sequence[float], rng: np.random.Generator) -> Effect:
    """How much better the treated are, pair by pair.

    Raises:
        ValueError: the samples are not pairs.
    """
    first, second = np.asarray(treated, float), np.asarray(control, float)
    if len(first) != len(second):
        raise ValueError(f"{len(first)} treated and {len(second)} control samples are no pairs")
    p = np.nan
    if len(first) > 1:
        p = stats.permutation_test(
            (first - second,), np.mean, permutation_type="samples", n_resamples=RESAMPLES, rng=rng
        ).pvalue
    difference = estimate(list(first - second), rng)
    smallest = 2.0 ** (1 - len(first)) if len(first) else np.nan
    return Effect(difference, float(p), smallest, probability_of_improvement(first, second))


def probability_of_improvement(
    first: Float[np.ndarray, " N"], second: Float[np.ndarray, " M"]
) -> float:
    """Share of pairs (x, y) with x > y, ties counted half (Mann and Whitney's U over N M)."""
    if not len(first) or not len(second):
        return np.nan
    return float(stats.mannwhitneyu(first, second).statistic) / (len(first) * len(second))


def curve(
    steps: Float[np.ndarray, " E"], values: Float[np.ndarray, " E"], grid: Float[np.ndarray, " G"]
) -> Float[np.ndarray, " G-1"]:
    """Mean of the episodes that ended in each interval of the grid; an empty one keeps the last.

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
    """Area under a curve over the whole budget, as a mean: what was had while learning."""
    return float(np.nanmean(values)) if np.isfinite(values).any() else np.nan


def steps_to(
    grid: Float[np.ndarray, " G"], values: Float[np.ndarray, " G-1"], threshold: float
) -> float:
    """Steps after which the curve stays at the threshold or above; infinity if it never does."""
    below = np.flatnonzero(~(values >= threshold))
    if not len(below):
        return float(grid[1])
    first = int(below[-1]) + 1
    return float(grid[first + 1]) if first < len(values) else np.inf


def claims(
    figures: Mapping[tuple[str, str], Mapping[int, float]],
    walking: Mapping[str, bool],
    rng: np.random.Generator,
) -> list[Claim]:
    """The paper's three claims, and the same two effects where the others are absent.

    Args:
        figures: By (move, setup), the figure of each seed; higher is better.
        walking: Of each move, whether it is walking.
    """
    dances = [move for move, walks in walking.items() if not walks]
    walks = [move for move, is_walking in walking.items() if is_walking]
    every, alone = list(walking), ("scratch-curiosity", "scratch")
    asked = [
        ("Pretraining helps", "pretrain", "scratch", 1, every),
        ("Curiosity helps on dances", "curiosity", "pretrain", 1, dances),
        ("Curiosity hurts on walking", "curiosity", "pretrain", -1, walks),
        ("Curiosity helps on dances, without pretraining", *alone, 1, dances),
        ("Curiosity hurts on walking, without pretraining", *alone, -1, walks),
        ("Pretraining helps, with curiosity", "curiosity", "scratch-curiosity", 1, every),
    ]  # fmt: skip
    return [_claim(figures, *question, rng) for question in asked]


def comparisons(
    figures: Mapping[tuple[str, str], Mapping[int, float]],
    moves: Sequence[str],
    rng: np.random.Generator,
) -> list[Comparison]:
    """The four effects of the 2 x 2 on every move alone, where a mean over moves may hide that one
    gains what another loses.
    """
    return [
        Comparison(
            treated,
            control,
            {move: _effect(figures, treated, control, [move], rng) for move in moves},
        )
        for treated, control in COMPARED
    ]


def _effect(
    figures: Mapping[tuple[str, str], Mapping[int, float]],
    treated: str,
    control: str,
    moves: Sequence[str],
    rng: np.random.Generator,
) -> Effect | None:
    """Pairs are seeds, each the mean over the moves that both setups have."""
    pairs = _pairs(figures, treated, control, moves)
    return effect([a for a, _ in pairs], [b for _, b in pairs], rng) if pairs else None


def _claim(
    figures: Mapping[tuple[str, str], Mapping[int, float]],
    text: str,
    treated: str,
    control: str,
    expected: int,
    moves: Sequence[str],
    rng: np.random.Generator,
) -> Claim:
    found = _effect(figures, treated, control, moves, rng)
    if found is None:
        return Claim(text, treated, control, expected, "not measured", None)
    return Claim(text, treated, control, expected, _verdict(found, expected), found)


def _pairs(
    figures: Mapping[tuple[str, str], Mapping[int, float]],
    treated: str,
    control: str,
    moves: Sequence[str],
) -> list[tuple[float, float]]:
    """For each seed that every move has in both setups, the means over the moves."""
    columns = [figures.get((move, setup), {}) for setup in (treated, control) for move in moves]
    if not columns or not all(columns):
        return []
    seeds = sorted(set.intersection(*(set(column) for column in columns)))
    half = len(moves)
    return [
        (
            float(np.mean([column[seed] for column in columns[:half]])),
            float(np.mean([column[seed] for column in columns[half:]])),
        )
        for seed in seeds
    ]


def _verdict(found: Effect, expected: int) -> Verdict:
    low, high = found.difference.low, found.difference.high
    if expected < 0:
        low, high = -high, -low
    if low > 0:
        return "holds"
    return "reversed" if high < 0 else "not shown"
