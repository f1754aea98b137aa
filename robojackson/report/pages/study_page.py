"""The page of a study: the paper's claims, Table II in numbers, curves, and conclusions.

Table II of the paper has adjectives; here each is a mean over seeds with its 95 % interval. The
page shows the return with all bonuses, like the paper, and the value of every policy by one
measure: curiosity off, lambda fixed, stock physics.
"""

import base64
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import groupby
from typing import Any

from robojackson.metrics.ablation_statistics import ON_MANY, Claim, Comparison
from robojackson.metrics.seed_statistics import Effect, Estimate
from robojackson.report.pages.inline import own, policy
from robojackson.report.pages.inline import render as from_template
from robojackson.report.pages.run_page import Plot

FIGURES: Mapping[str, tuple[str, int, float]] = {
    "final_return": ("return at the end, with bonuses", 1, 1.0),
    "area": ("mean return while learning", 1, 1.0),
    "steps_to": ("steps to the threshold", 0, 1.0),
    "return_own": ("return by the yardstick", 1, 1.0),
    "survived_s": ("survival, s", 2, 1.0),
    "stand_s": ("survival from the stand, s", 2, 1.0),
    "strict_success": ("strict success, %", 0, 100.0),
    "skill": ("skill", 2, 1.0),
    "limb_gain": ("limb gain", 2, 1.0),
}
"""Columns of the table: title, digits, factor."""
BODIES = {
    "statue": "statue",
    "mean_pose": "mean pose",
    "flail": "flailing body",
    "zero_residual": "zero residual",
}
"""Titles of the bodies that do not dance, by the names of
`robojackson.rl.evaluation.reward_audit`."""

RewardAudits = Mapping[str, Mapping[str, float]]
"""Shares of a perfect dance's reward that each body earns, by setup and body."""


@dataclass(frozen=True)
class Line:
    """One row of the table.

    Attributes:
        move, setup: What was trained, or the name of a baseline.
        seeds: Number of seeds.
        values: Estimates by name of the figure.
        baseline: Whether it is a baseline, which learns nothing.
    """

    move: str
    setup: str
    seeds: int
    values: Mapping[str, Estimate]
    baseline: bool = False


@dataclass(frozen=True)
class Sparkline:
    """A curve in a table: corners of a polyline, and what it shows in words."""

    points: str
    title: str


SPARK_WIDTH, SPARK_HEIGHT = 96, 36
"""Of the drawing; study.html has the same."""


@dataclass(frozen=True)
class StudyContent:
    """The content of the page.

    Attributes:
        title: Title of the study.
        facts: Method of the study, by name.
        claims: Claims of the paper, with our findings.
        lines: The table.
        comparisons: The yardstick's differences between setups, move by move.
        reward_audits: Rewards of bodies that do not dance, by move.
        moves: A picture of each move: frame, recovered body, robot (Figures 2-4).
        thumbnails: The same small, JPEG as base64, by move.
        learning: Mean return of the episodes of each interval of training, by (move, setup).
        curves: Learning curves (Figures 5-13).
        evaluation_plots: Plots of the evaluation.
        notes: Warnings for the reader.
    """

    title: str
    facts: Mapping[str, Any] = field(default_factory=dict)
    claims: Sequence[Claim] = ()
    lines: Sequence[Line] = ()
    comparisons: Sequence[Comparison] = ()
    reward_audits: Mapping[str, RewardAudits] = field(default_factory=dict)
    moves: Sequence[Plot] = ()
    thumbnails: Mapping[str, str] = field(default_factory=dict)
    learning: Mapping[tuple[str, str], Sequence[float]] = field(default_factory=dict)
    curves: Sequence[Plot] = ()
    evaluation_plots: Sequence[Plot] = ()
    notes: Sequence[str] = ()


def render(content: StudyContent) -> str:
    """Return the page as HTML, one file with everything in it."""
    compared, styles = content.comparisons, [own("page.css")]
    drawn = sparklines(content.learning)
    return from_template(
        "study.html",
        styles,
        [],
        security=policy([], styles),
        content=content,
        columns=[title for title, _, _ in FIGURES.values()],
        moves=[
            (
                move,
                [
                    (
                        line,
                        drawn.get((line.move, line.setup)),
                        [cell(line.values.get(k), k, line.seeds) for k in FIGURES],
                    )
                    for line in of
                ],
            )
            for move, of in groupby(content.lines, lambda line: line.move)
        ],
        effects=[(c, [_difference(found) for found in c.effects.values()]) for c in compared],
        on_many=ON_MANY in [(c.treated, c.control) for c in compared],
        compared_on=list(compared[0].effects) if compared else [],
        paid={move: _by_reward(paid) for move, paid in content.reward_audits.items()},
        bodies=BODIES,
        claims=[(claim, sentence(claim)) for claim in content.claims],
        groups=[
            ("The moves", _encoded(content.moves)),
            ("While learning", _encoded(content.curves)),
            ("Evaluated alike", _encoded(content.evaluation_plots)),
        ],
    )


def sparklines(
    learning: Mapping[tuple[str, str], Sequence[float]],
) -> dict[tuple[str, str], Sparkline]:
    """Draw curves; those of one move have one scale, so that they compare."""
    found = {}
    for (move, setup), values in learning.items():
        known = [v for (m, _), of in learning.items() if m == move for v in of if math.isfinite(v)]
        shown = [(at, value) for at, value in enumerate(values) if math.isfinite(value)]
        if not shown or len(values) < 2:
            continue
        low, span = min(known), max(max(known) - min(known), 1e-9)
        across, down = SPARK_WIDTH / (len(values) - 1), SPARK_HEIGHT - 2
        points = " ".join(
            f"{at * across:.1f},{1 + down * (1 - (v - low) / span):.1f}" for at, v in shown
        )
        first, last = (f"{shown[end][1]:,.0f}" for end in (0, -1))
        found[move, setup] = Sparkline(points, f"return while learning: from {first} to {last}")
    return found


def cell(value: Estimate | None, key: str, seeds: int) -> tuple[str, list[str]]:
    """Return a mean, a dash where there is none; its interval, and the number of seeds if not
    all."""
    if value is None or math.isnan(value.mean):
        return "–", []
    _, digits, factor = FIGURES[key]
    if math.isinf(value.mean):
        return "never", []
    spread = []
    if value.low < value.high:
        spread.append(f"[{factor * value.low:z,.{digits}f}, {factor * value.high:z,.{digits}f}]")
    if value.count < seeds:
        spread.append(f"({value.count} of {seeds})")
    return f"{factor * value.mean:z,.{digits}f}", spread


def sentence(claim: Claim) -> str:
    """Return the finding on a claim, in words and numbers."""
    if claim.effect is None:
        return f"Not measured here: {claim.treated} or {claim.control} was not trained."
    found = claim.effect.difference
    if not found.count:
        both = f"{claim.treated} and {claim.control}"
        return f"Not measured here: no seed has a figure of both {both}."
    how = {
        "holds": "Holds here",
        "reversed": "The opposite holds here",
        "not shown": "Not shown here",
    }[claim.verdict]
    text = f"{how}: {claim.treated} minus {claim.control} is {found.mean:+.3g}"
    if math.isfinite(found.low):
        text += f" [{found.low:+.3g}, {found.high:+.3g}]"
    text += f" over {found.count} paired seed{'s' if found.count != 1 else ''}"
    if math.isfinite(claim.effect.p):
        least = claim.effect.smallest_p
        text += f", p = {claim.effect.p:.2g} (no smaller than {least:.2g} with so few)"
    return f"{text}; {100 * claim.effect.improvement:.0f} % chance that one run of it is better."


def _by_reward(paid: RewardAudits) -> list[tuple[str, list[str]]]:
    """Return setups of one reward together, with its shares in per cent."""
    shares = {setup: [f"{100 * of[body]:.0f}" for body in BODIES] for setup, of in paid.items()}
    rewards = dict.fromkeys(map(tuple, shares.values()))
    return [(", ".join(s for s in shares if tuple(shares[s]) == r), list(r)) for r in rewards]


def _difference(found: Effect | None) -> str:
    if found is None or not found.difference.count:
        return "–"
    text = f"{found.difference.mean:+,.1f}"
    if math.isfinite(found.difference.low):
        text += f" [{found.difference.low:+,.1f}, {found.difference.high:+,.1f}]"
    return text


def _encoded(plots: Sequence[Plot]) -> list[tuple[Plot, str]]:
    return [(plot, base64.b64encode(plot.png).decode()) for plot in plots]
