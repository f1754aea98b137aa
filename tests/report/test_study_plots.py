"""The figures of a study."""

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
