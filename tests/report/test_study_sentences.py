"""Sentences of a study's page: what its rows are, and claims that nothing was measured of."""

import math
import re

import numpy as np
import pytest

from robojackson.metrics.ablation_statistics import claims, comparisons
from robojackson.report.pages.study_page import StudyContent, render, sentence

SETUPS = ("scratch", "pretrain", "curiosity", "scratch-curiosity", "pretrained-dancer")


def caption(setups: tuple[str, ...]) -> str:
    """Return the sentence under the effects of a study of these setups."""
    figures = {("walk", setup): {0: 1.0, 1: 2.0} for setup in setups}
    compared = comparisons(figures, ["walk"], np.random.default_rng(0))
    page = render(StudyContent("known", comparisons=compared))
    found = re.search(r"The first two rows are(.*?)</p>", page, re.S)
    assert found is not None
    return " ".join(found[1].split())


@pytest.mark.parametrize(
    ("setups", "expected"),
    [
        (SETUPS[:-1], "the last two curiosity without and with pretraining."),
        (
            SETUPS,
            "the next two curiosity without and with pretraining, the last a start from our "
            "network of many motions.",
        ),
    ],
)
def test_every_row_of_the_effects_is_described(setups: tuple[str, ...], expected: str) -> None:
    assert caption(setups) == f"pretraining without and with curiosity, {expected}"


def test_a_claim_without_a_pair_to_compare_was_not_measured() -> None:
    figures = {
        ("walk", "scratch"): {0: math.nan, 1: math.nan},
        ("walk", "pretrain"): {0: 1.0, 1: 2.0},
    }
    rng = np.random.default_rng(0)
    helps, *_ = claims(figures, {"walk": True}, rng)
    assert helps.verdict == "not measured"
    assert sentence(helps) == (
        "Not measured here: no seed has a figure of both pretrain and scratch."
    )
    page = render(StudyContent("known", comparisons=comparisons(figures, ["walk"], rng)))
    assert "nan" not in page[page.index("<main>") :]
