"""Texts of an evaluation: one sentence, tiles and rows of tables."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from robojackson.report.quantities import POLICY_TITLES, Quantity, format_value, quantities
from robojackson.report.web.beats import TITLES
from robojackson.rl.config.evaluate_config import TRAINED
from robojackson.rl.evaluation.verdict import NEEDS_FULL_LENGTH

Evaluation = Mapping[str, Any]
"""The content of evaluation.json."""

VERDICT_COLUMNS = (
    "survived_s", "success", "strict_success", "skill", "site_error_m", "limb_gain", "drift_m",
    "heading_error_deg",
)  # fmt: skip
RESPONSES = ("limb_gain", "limb_r2", "excess_speed")
"""Figures of each limb."""
NOT_TRAINED = "follows any motion, not trained on this one"
"""Description of a tracker."""
TOO_SHORT = "too short"
"""In place of a figure where rollouts are too short to evaluate."""


@dataclass(frozen=True)
class Verdict:
    """One row of the evaluation table."""

    title: str
    meaning: str
    values: Sequence[str]
    trained: bool
    failed: bool = False


def dancer_of(evaluation: Evaluation) -> str:
    """Return the dancer's title: the trained robot, or a tracker by its name."""
    name = evaluation.get("tracker")
    return POLICY_TITLES[TRAINED][0] if name is None else f"tracker {name}"


def dancer_title(evaluation: Evaluation) -> str:
    """Return the title of the dancer's pane."""
    title = dancer_of(evaluation)
    return f"Robot, {title}" if "tracker" in evaluation else title.capitalize()


def headline(evaluation: Evaluation) -> str:
    """Return one sentence about the result, beside the best of the baselines that have a figure."""
    if not evaluation:
        return ""
    text = str(evaluation.get("verdict", {}).get("sentence", ""))
    ours = _share(evaluation)
    if ours is None:
        return text
    text += " " if text else ""
    text += (
        f"The {dancer_of(evaluation)} finished {format_value('success', ours)} of "
        f"{format_value('rollouts', evaluation['rollouts'])} rollouts without a fall"
    )
    found = {name: _share(one) for name, one in evaluation.get("baselines", {}).items()}
    shares = {name: share for name, share in found.items() if share is not None}
    if not shares:
        return f"{text}."
    name = max(shares, key=lambda key: shares[key])
    best, theirs = POLICY_TITLES.get(name, (name, ""))[0], shares[name]
    if theirs < ours:
        return f"{text}; the best baseline ({best}) {format_value('success', theirs)}."
    how = "as well" if theirs == ours else "better"
    figure = format_value("success", theirs)
    return f"{text}; a baseline that learnt nothing ({best}) does {how}: {figure}."


def _share(figures: Evaluation) -> float | None:
    """Return the share of the rollouts without a fall; None where there is no figure."""
    share = figures.get("success")
    return None if share is None or not math.isfinite(share) else float(share)


def next_step(evaluation: Evaluation, longer: str) -> tuple[str, str]:
    """Return what to do about a robot that does not dance, and the option of `dance` that does it;
    empty texts for one that dances.

    Args:
        longer: Options of a longer training.
    """
    kind = evaluation.get("verdict", {}).get("kind")
    if kind in (None, "dances"):
        return "", ""
    if kind == "too_short":
        return "Film or choose a range of at least two seconds:", "--start, --end"
    if "tracker" in evaluation:
        return "Train the robot on this dance: the same command without", "--instant"
    return "Train longer: the same command with", longer


def tiles(evaluation: Evaluation) -> list[Quantity]:
    """Return the headline figures of an evaluation."""
    meanings = {
        "success": "no fall in a whole rollout",
        "survived_s": "mean time before a fall",
        "skill": "1 is perfect, 0 is the best frozen pose",
        "site_error_m": "mean distance from the reference",
        "limb_gain": "1 is the whole amplitude",
    }
    found = {key: evaluation[key] for key in meanings if evaluation.get(key) is not None}
    return [
        Quantity(f.label, f.value, meanings[key])
        for key, f in zip(found, quantities(found), strict=True)
    ]


def verdicts(evaluation: Evaluation) -> list[Verdict]:
    """Return the figures of the trained policy and of its baselines, formatted."""
    if not evaluation:
        return []
    trackers = evaluation.get("trackers", {})
    policies = {TRAINED: evaluation, **trackers, **evaluation.get("baselines", {})}
    rows = []
    for name, figures in policies.items():
        title, meaning = POLICY_TITLES.get(name, (name, ""))
        if "tracker" in figures:
            title, meaning = dancer_of(figures), NOT_TRAINED
        short = evaluation.get("verdict", {}).get("kind") == "too_short"
        values = [
            TOO_SHORT
            if short and column in NEEDS_FULL_LENGTH
            else format_value(column, figures.get(column))
            for column in VERDICT_COLUMNS
        ]
        rows.append(Verdict(title, meaning, values, name == TRAINED))
    return rows


F1 = 3
"""Place of F1 in the values of a row of beats."""
PASSPORT_COLUMNS = ("strict_success", "skill", "survived_s", "kept", "robust")


def passport_rows(evaluation: Evaluation) -> list[Verdict]:
    """Return the figures of the policy under other physics, formatted."""
    return [
        Verdict(
            row["case"],
            "",
            [format_value(key, row.get(key)) for key in PASSPORT_COLUMNS],
            index == 0,
            failed=row.get("robust") is False,
        )
        for index, row in enumerate(evaluation.get("passport", []))
    ]


def beat_tiles(rows: Sequence[Verdict]) -> list[Quantity]:
    """Return how the dancer meets the music, beside chance, as a headline figure."""
    if not rows:
        return []
    *_, dancer, control = rows
    meaning = f"{dancer.title}; half a beat later {control.values[F1]}"
    return [Quantity("on the beat (F1)", dancer.values[F1], meaning)]


def beat_rows(report: Evaluation) -> list[Verdict]:
    """Return how motions meet the music (`beat_report`), formatted."""
    return [
        Verdict(
            TITLES[name],
            "",
            [
                str(one["beats"]),
                f"{100 * one['precision']:.0f}%",
                f"{100 * one['recall']:.0f}%",
                f"{one['f1']:.2f}",
                f"{one['bas']:.2f}",
            ],
            name == "robot",
        )
        for name, one in report["figures"].items()
    ]
