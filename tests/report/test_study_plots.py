"""The figures of a study."""

import numpy as np

from robojackson.report.pages.study_figures import evaluation_figure
from robojackson.report.plots.study_plots import evaluation_plot


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
