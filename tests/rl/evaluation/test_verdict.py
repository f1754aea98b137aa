"""What an evaluation says: nothing of what shows nothing."""

import pytest

from robojackson.rl.evaluation.verdict import NEEDS_FULL_LENGTH, verdict_on, without_short_figures


def figures(survived_s: float, strict: float, skill: float = 0.5) -> dict[str, float]:
    return {"survived_s": survived_s, "strict_success": strict, "skill": skill}


STATUE = {"statue": figures(1.6, 0.0, 0.0)}


@pytest.mark.parametrize(
    ("own", "baselines", "seconds", "updates", "kind"),
    [
        (figures(10, 1.0), STATUE, 10.0, 5, "dances"),
        (figures(7, 0.6), STATUE, 10.0, 5, "partly"),
        (figures(5, 0.0), STATUE, 10.0, 5, "learning"),
        (figures(1.9, 0.0), STATUE, 10.0, 5, "falls"),
        (figures(10, 0.4), {"statue": figures(10, 0.0)}, 10.0, 5, "learning"),
        (figures(0.5, 1.0), {"statue": figures(0.5, 1.0)}, 0.5, 5, "too_short"),
        (figures(1.6, 1.0), STATUE, 1.6, 5, "too_short"),
        (figures(10, 1.0), {"random": figures(9, 0.9)}, 10.0, 5, "too_short"),
        (figures(1.0, 0.0), STATUE, 10.0, 0, "untrained"),
        (figures(1.0, 1.0), STATUE, 1.0, 0, "too_short"),
        (figures(10, 1.0), STATUE, 10.0, None, "dances"),
    ],
)
def test_the_kind_follows_from_the_figures(
    own: dict, baselines: dict, seconds: float, updates: int | None, kind: str
) -> None:
    verdict = verdict_on(own, baselines, seconds, updates)
    assert verdict.kind == kind
    assert verdict.as_facts()["kind"] == kind
    assert verdict.sentence.endswith(".")


def test_a_fall_is_reported_beside_the_statue() -> None:
    text = verdict_on(figures(1.1, 0.0), STATUE, 10.0).sentence
    assert text == "The robot falls after 1.1 s, no better than a statue."


def test_no_success_is_reported_of_what_is_too_short() -> None:
    result = verdict_on(figures(0.5, 1.0), {"statue": figures(0.5, 1.0)}, 0.5)
    assert result.sentence.startswith("Too short to evaluate: rollouts last 0.5 s, and a statue")
    left = without_short_figures({"success": 1.0, "skill": 0.9, "survived_s": 0.5})
    assert left == {"success": None, "skill": None, "survived_s": 0.5}
    assert set(left) - {"survived_s"} <= set(NEEDS_FULL_LENGTH)


def test_a_motion_without_a_skill_is_reported_without_one() -> None:
    sentence = verdict_on(figures(10, 1.0, float("nan")), STATUE, 10.0).sentence
    assert sentence == "The robot dances: it follows from 100% of the starts to the end."
