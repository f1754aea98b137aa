"""The verdict of an evaluation: a kind with figures, from which the sentence is made."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

Kind = Literal["too_short", "untrained", "falls", "learning", "partly", "dances"]
LEAST_MOTION_S, SHORTEST_S = 2.0, 1.7
"""Length below which a motion is too short to evaluate a robot on, and mean length of its rollouts,
which begin in the first quarter of a motion that ends: a body that does nothing does not fall that
fast."""
EASY = 0.5
"""Strict success of a body that does not dance above which an evaluation is meaningless."""
DANCES = 0.95
"""Least strict success of a robot that dances."""
PARTLY = 0.5
NO_BETTER = 1.25
"""Factor on the best baseline's survival up to which a robot counts as no better."""
UPRIGHT = 0.9
"""Share of a rollout's length from which a robot that is up for so long does not count as falling,
whatever its baselines do."""
LONGER_MINUTES = 15.0
"""Least budget that a pass is advised to take whose robot does not dance, minutes."""
NEEDS_FULL_LENGTH = ("success", "strict_success", "skill")
"""Figures that are empty where the rollouts are too short to evaluate."""
TITLES = {
    "statue": "a statue",
    "mean_pose": "the mean pose",
    "zero_residual": "the bare reference",
    "random": "a random policy",
}


@dataclass(frozen=True)
class Verdict:
    """The verdict on a policy.

    Attributes:
        kind: Name of the verdict.
        seconds: Mean length of the rollouts, seconds.
        survived_s: Mean survival of the policy, seconds.
        strict_success: Strict success of the policy, 0..1.
        skill: Skill of the policy; 1 is perfect.
        baseline: The body that does not dance and comes nearest.
        baseline_s: Mean survival of the baseline, seconds.
        baseline_success: Strict success of the baseline, 0..1.
    """

    kind: Kind
    seconds: float
    survived_s: float
    strict_success: float
    skill: float
    baseline: str = ""
    baseline_s: float = 0.0
    baseline_success: float = 0.0

    @property
    def sentence(self) -> str:
        """Return the verdict in one sentence."""
        other = TITLES.get(self.baseline, self.baseline)
        if self.kind == "too_short":
            why = f"rollouts last {self.seconds:.1f} s"
            if self.baseline_success >= EASY:
                why += f", and {other} succeeds in {self.baseline_success:.0%} of them"
            return f"Too short to evaluate: {why}."
        if self.kind == "untrained":
            return "The robot has learnt nothing: the training ended before its first update."
        if self.kind == "dances":
            return (
                f"The robot dances: it follows from {self.strict_success:.0%} of the starts to the "
                f"end{self._skilled()}."
            )
        if self.kind == "partly":
            return (
                f"The robot dances from {self.strict_success:.0%} of the starts and falls or "
                f"strays from the others{self._skilled()}."
            )
        if self.kind == "falls":
            return f"The robot falls after {self.survived_s:.1f} s, no better than {other}."
        return (
            f"The robot does not dance yet: it stays up for {self.survived_s:.1f} of "
            f"{self.seconds:.1f} s, {other} for {self.baseline_s:.1f} s."
        )

    def _skilled(self) -> str:
        """Return the skill, which a motion that hardly moves has not, as the end of a sentence."""
        return f", skill {self.skill:.2f} of 1" if math.isfinite(self.skill) else ""

    def as_facts(self) -> dict[str, Any]:
        """Return kind and sentence for evaluation.json."""
        return {"kind": self.kind, "sentence": self.sentence, "seconds": self.seconds}


def verdict_on(
    own: Mapping[str, float],
    baselines: Mapping[str, Mapping[str, float]],
    seconds: float,
    updates: int | None = None,
) -> Verdict:
    """Return the verdict on a policy.

    Args:
        own: Means over its rollouts: survived_s, strict_success, skill.
        baselines: The same of bodies that do not dance, by name.
        seconds: Mean length of rollouts that do not end early, seconds: of a motion that ends,
            those that begin later are shorter.
        updates: Gradient updates of its training; None where unknown.
    """
    survived = {name: found["survived_s"] for name, found in baselines.items()}
    success = {name: found["strict_success"] for name, found in baselines.items()}
    easiest = max(success, key=lambda name: (success[name], survived[name]), default="")
    figures = (own["survived_s"], own["strict_success"], own["skill"])
    known = (easiest, survived.get(easiest, 0.0), success.get(easiest, 0.0))
    return Verdict(_kind(own, known[1], known[2], seconds, updates), seconds, *figures, *known)


def _kind(
    own: Mapping[str, float],
    baseline_s: float,
    baseline_success: float,
    seconds: float,
    updates: int | None,
) -> Kind:
    if seconds < SHORTEST_S:
        return "too_short"
    if updates == 0:
        return "untrained"
    if baseline_success >= EASY:
        return "too_short"
    if own["strict_success"] >= DANCES:
        return "dances"
    if own["strict_success"] >= PARTLY:
        return "partly"
    most_s = min(NO_BETTER * baseline_s, UPRIGHT * seconds)
    return "falls" if own["survived_s"] <= most_s else "learning"


def longer_minutes(minutes: float) -> float:
    """Return the budget that is advised after a pass of `minutes` whose robot does not dance."""
    return max(2 * minutes, LONGER_MINUTES)


def without_short_figures(figures: Mapping[str, Any]) -> dict[str, Any]:
    """Return figures without those that are meaningless in rollouts that are too short."""
    return {**figures, **{name: None for name in NEEDS_FULL_LENGTH if name in figures}}
