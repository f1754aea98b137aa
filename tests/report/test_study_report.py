"""The page of a study: its figures, what its rows are, and claims that nothing was measured of."""

import math
import re

import numpy as np
import pytest

from robojackson.metrics.ablation_statistics import claims, comparisons
from robojackson.report.pages.study_figures import evaluation_figure
from robojackson.report.pages.study_page import StudyContent, render, sentence
from robojackson.report.plots.study_plots import evaluation_plot

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


def test_the_legend_names_the_baselines_of_every_move_each_drawn_alike() -> None:
    figures = {"walk": {"scratch": [1.0, 2.0]}, "wave": {"scratch": [1.0], "pretrain": [3.0]}}
    known = {"walk": {"statue": 1.0}, "wave": {"random": 0.5, "statue": 0.2}}
    drawn = evaluation_plot(figures, known, "skill")
    (legend,) = drawn.legends
    named = dict(zip(legend.get_texts(), legend.get_lines(), strict=True))
    styles = {text.get_text(): line.get_linestyle() for text, line in named.items()}
    assert set(styles) == {"statue", "random"}
    for panel in drawn.axes:
        found = {str(line.get_label()): line.get_linestyle() for line in panel.lines}
        assert all(found[name] == style for name, style in styles.items() if name in found)


def test_without_baselines_there_is_no_legend() -> None:
    assert evaluation_plot({"walk": {"scratch": [1.0]}}, {"walk": {}}, "skill").legends == []


def test_a_share_is_drawn_in_per_cent_as_its_axis_says() -> None:
    by_key = {("walk", "scratch"): {0: 0.25, 1: 0.75}}
    known = {"walk": {"statue": {"strict_success": 0.1}}}
    drawn = evaluation_figure("strict_success", by_key, known, ["walk"], ["scratch"])
    (panel,) = drawn.axes
    dots = np.asarray(panel.collections[0].get_offsets())[:, 1]
    heights = [float(np.asarray(line.get_ydata())[0]) for line in panel.lines]
    assert panel.get_ylabel() == "strict success, %"
    assert dots.tolist() == [25.0, 75.0]
    assert heights == [50.0, 10.0]  # the mean of the seeds, the baseline
