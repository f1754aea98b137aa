"""Statistics of an ablation: three claims of the paper, and effects move by move.

Pairs are seeds, each the mean over the moves that both setups have; `seed_statistics` has the
tests. Nothing here knows where tables are kept.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from robojackson.metrics.seed_statistics import Effect, effect

COMPARED = (
    ("pretrain", "scratch"),
    ("curiosity", "scratch-curiosity"),
    ("scratch-curiosity", "scratch"),
    ("curiosity", "pretrain"),
)
"""Pairs of setups with one difference: two in pretraining, two in curiosity."""
ON_MANY = ("pretrained-dancer", "scratch")
"""Pair of a study of a network of many motions, which the paper has not; they differ in the start,
and in the width of the actor and its first exploration."""
Verdict = Literal["holds", "not shown", "reversed", "not measured"]


@dataclass(frozen=True)
class Claim:
    """One claim of the paper, and the result.

    Attributes:
        text: The claim in words.
        treated, control: Setups that are compared.
        expected: 1 when the treated should be better, -1 when worse.
        verdict: `holds` and `reversed` only where the interval of the effect leaves out zero.
        effect: None where no seed was trained with both; of no pairs where none has a figure of
            both.
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
        effects: Effects by move; None where it was not measured.
    """

    treated: str
    control: str
    effects: Mapping[str, Effect | None]


def claims(
    figures: Mapping[tuple[str, str], Mapping[int, float]],
    walking: Mapping[str, bool],
    rng: np.random.Generator,
) -> list[Claim]:
    """Return the paper's three claims, and the same two effects where the others are absent.

    Where a dancer was started from, whether that helps is one more.

    Args:
        figures: The figure of each seed, by (move, setup); higher is better.
        walking: Whether each move is walking.
    """
    dances = [move for move, walks in walking.items() if not walks]
    walks = [move for move, is_walking in walking.items() if is_walking]
    every, alone = list(walking), ("scratch-curiosity", "scratch")
    questions = [
        ("Pretraining helps", "pretrain", "scratch", 1, every),
        ("Curiosity helps on dances", "curiosity", "pretrain", 1, dances),
        ("Curiosity hurts on walking", "curiosity", "pretrain", -1, walks),
        ("Curiosity helps on dances, without pretraining", *alone, 1, dances),
        ("Curiosity hurts on walking, without pretraining", *alone, -1, walks),
        ("Pretraining helps, with curiosity", "curiosity", "scratch-curiosity", 1, every),
    ]  # fmt: skip
    if _has_dancer(figures):
        questions.append(("Pretraining on many motions helps", *ON_MANY, 1, every))
    return [_claim(figures, *question, rng) for question in questions]


def comparisons(
    figures: Mapping[tuple[str, str], Mapping[int, float]],
    moves: Sequence[str],
    rng: np.random.Generator,
) -> list[Comparison]:
    """Return the four effects of the 2 x 2 on every move alone.

    A mean over moves may hide that one gains what another loses. Where a dancer was started from,
    its effect is one more.
    """
    pairs = (*COMPARED, ON_MANY) if _has_dancer(figures) else COMPARED
    return [
        Comparison(
            treated,
            control,
            {move: _effect(figures, treated, control, [move], rng) for move in moves},
        )
        for treated, control in pairs
    ]


def _has_dancer(figures: Mapping[tuple[str, str], Mapping[int, float]]) -> bool:
    return any(setup == ON_MANY[0] for _, setup in figures)


def _effect(
    figures: Mapping[tuple[str, str], Mapping[int, float]],
    treated: str,
    control: str,
    moves: Sequence[str],
    rng: np.random.Generator,
) -> Effect | None:
    """Return one effect; pairs are seeds, each the mean over the moves that both setups have."""
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
    if found is None or not found.difference.count:
        return Claim(text, treated, control, expected, "not measured", found)
    return Claim(text, treated, control, expected, _verdict(found, expected), found)


def _pairs(
    figures: Mapping[tuple[str, str], Mapping[int, float]],
    treated: str,
    control: str,
    moves: Sequence[str],
) -> list[tuple[float, float]]:
    """Return the means over the moves, for each seed that every move has in both setups."""
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
