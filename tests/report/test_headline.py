"""The sentence of an evaluation compares what has a figure, and nothing else."""

import math

import pytest

from robojackson.report.pages.evaluation_text import headline

NAN = math.nan


@pytest.mark.parametrize("nothing", [None, NAN])
def test_a_baseline_without_a_figure_is_left_out(nothing: float | None) -> None:
    baselines = {"statue": {"success": nothing}, "random": {"success": 0.25}, "mean_pose": {}}
    evaluation = {"success": 0.5, "rollouts": 73.0, "baselines": baselines}
    assert headline(evaluation).endswith("without a fall; the best baseline (random) 25%.")
    alone = {**evaluation, "baselines": {"statue": {"success": nothing}}}
    assert headline(alone).endswith("of 73 rollouts without a fall.")


@pytest.mark.parametrize("nothing", [None, NAN])
def test_a_robot_without_a_figure_is_neither_better_nor_worse(nothing: float | None) -> None:
    evaluation = {
        "success": nothing,
        "rollouts": 0.0,
        "verdict": {"sentence": "Too short."},
        "baselines": {"statue": {"success": 0.5}},
    }
    assert headline(evaluation) == "Too short."
