"""Figures of a study: the paper's 5-13 (return and length of training episodes against steps) and
the evaluation of every setup beside a statue.

A line is the mean over seeds, its band the range of the seeds.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import cycle

import numpy as np
from jaxtyping import Float
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from robojackson.report.plots.run_plots import ACCENT, GOOD, INK, SECOND, WARM, figure_of

COLOURS = {"scratch": INK, "pretrain": ACCENT, "curiosity": SECOND, "scratch-curiosity": WARM}

STYLES = (":", "--", "-.", (0, (1, 4)), (0, (5, 5)))


@dataclass(frozen=True)
class Curves:
    """Training curves of one setup on one move.

    Attributes:
        steps: Middle of each interval, control steps.
        returns: Mean return of the episodes that ended in the interval, a row a seed.
        lengths: Mean length of the episodes, control steps, a row a seed.
    """

    steps: Float[np.ndarray, " G"]
    returns: Float[np.ndarray, "K G"]
    lengths: Float[np.ndarray, "K G"]


def learning_curves(curves: Mapping[str, Curves]) -> Figure:
    """Plot one move: return above, length below, a column a setup (Figures 5-13 of the paper)."""
    count = max(len(curves), 1)
    figure, axes = figure_of(2.6 * count + 0.8, 4.2, rows=2, columns=count, sharex=True)
    for column, (setup, found) in enumerate(curves.items()):
        colour = COLOURS.get(setup, GOOD)
        top, bottom = axes[column], axes[count + column]
        _band(top, found.steps, found.returns, colour)
        _band(bottom, found.steps, found.lengths, colour)
        top.set_title(setup, color=INK, fontsize=9)
        bottom.set_xlabel("control steps")
        bottom.ticklabel_format(axis="x", style="sci", scilimits=(-3, 4))
    _same_height(axes[:count])
    _same_height(axes[count:])
    axes[0].set_ylabel("episode return")
    axes[count].set_ylabel("episode length, steps")
    return figure


def evaluation_plot(
    figures: Mapping[str, Mapping[str, Sequence[float]]],
    baselines: Mapping[str, Mapping[str, float]],
    label: str,
) -> Figure:
    """Plot a figure of every setup on every move, a dot a seed, with the baselines as lines.

    Args:
        figures: Value of each seed, by move and setup.
        baselines: Value by move and baseline.
        label: Name of the value.
    """
    count = max(len(figures), 1)
    figure, axes = figure_of(2.4 * count + 0.8, 2.8, columns=count)
    names = dict.fromkeys(name for move in figures for name in baselines.get(move, {}))
    styles = dict(zip(names, cycle(STYLES), strict=False))
    for panel, (move, setups) in zip(axes, figures.items(), strict=False):
        for place, (setup, values) in enumerate(setups.items()):
            _dots(panel, place, np.asarray(values, float), COLOURS.get(setup, GOOD))
        for name, value in baselines.get(move, {}).items():
            panel.axhline(value, color=INK, lw=1.0, ls=styles[name], label=name)
        panel.set_xticks(range(len(setups)), list(setups), rotation=20, ha="right")
        panel.set_title(move, color=INK, fontsize=9, loc="left")
    _same_height(axes)
    axes[0].set_ylabel(label)
    if names:
        drawn = dict(pair for panel in axes for pair in _labelled(panel))
        lines = [drawn[name] for name in names]
        figure.legend(lines, list(names), fontsize=7, labelcolor=INK, frameon=False, ncols=4,
                      loc="outside upper center")  # fmt: skip
    return figure


def _labelled(axes: Axes) -> list[tuple[str, Artist]]:
    """Return the labels of a panel with what they name."""
    artists, labels = axes.get_legend_handles_labels()
    return [(str(label), artist) for label, artist in zip(labels, artists, strict=True)]


def _band(
    axes: Axes, steps: Float[np.ndarray, " G"], values: Float[np.ndarray, "K G"], colour: str
) -> None:
    known = np.isfinite(values).any(0)
    if not known.any():
        return
    some, x = values[:, known], steps[known]
    axes.fill_between(x, np.nanmin(some, 0), np.nanmax(some, 0), color=colour, alpha=0.22, lw=0)
    axes.plot(x, np.nanmean(some, 0), color=colour, lw=1.6)


def _dots(axes: Axes, place: int, values: Float[np.ndarray, " K"], colour: str) -> None:
    spread = np.linspace(-0.12, 0.12, len(values)) if len(values) > 1 else np.zeros(len(values))
    axes.scatter(place + spread, values, s=16, color=colour, alpha=0.75, lw=0)
    if len(values):
        axes.plot([place - 0.25, place + 0.25], [values.mean()] * 2, color=colour, lw=2.2)


def _same_height(axes: Sequence[Axes]) -> None:
    low = min(panel.get_ylim()[0] for panel in axes)
    high = max(panel.get_ylim()[1] for panel in axes)
    for panel in axes:
        panel.set_ylim(low, high)
