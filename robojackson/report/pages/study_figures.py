"""The plots of a study: a learning curve a move, and for each figure a dot a seed."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float

from robojackson.report.pages.run_page import Plot
from robojackson.report.pages.study_page import FIGURES
from robojackson.report.pages.study_table import BySeed

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SeedCurves = Mapping[tuple[str, str], Mapping[int, Mapping[str, np.ndarray]]]
"""`episode_return` and `episode_length` of each interval, by (move, setup) and seed."""


def curve_plots(
    curves: SeedCurves,
    grids: Mapping[str, Float[np.ndarray, " G"]],
    moves: Sequence[str],
    setups: Sequence[str],
) -> list[Plot]:
    """Draw the learning curves of each move that has any.

    Args:
        grids: Ends of the intervals of a move's curves, control steps.
    """
    from robojackson.report.plots.run_plots import png  # matplotlib: only when something is drawn
    from robojackson.report.plots.study_plots import Curves, learning_curves

    made = []
    for move in moves:
        middle = (grids[move][1:] + grids[move][:-1]) / 2
        drawn: dict[str, Curves] = {
            setup: Curves(
                middle,
                np.array([seed["episode_return"] for seed in curves[move, setup].values()]),
                np.array([seed["episode_length"] for seed in curves[move, setup].values()]),
            )
            for setup in setups
            if (move, setup) in curves
        }
        if drawn:
            caption = (
                "Training episodes: return with bonuses, and length. Mean and range over seeds."
            )
            made.append(Plot(f"Learning {move}", caption, png(learning_curves(drawn))))
    return made


def evaluation_plots(
    figures: Mapping[str, BySeed],
    baselines: Mapping[str, Mapping[str, Mapping[str, float]]],
    moves: Sequence[str],
    setups: Sequence[str],
) -> list[Plot]:
    """Draw the figures for which any seed has a value.

    Args:
        figures: Values of the seeds, by name of the figure.
        baselines: Figures by move, policy and name of the figure; drawn as lines.
    """
    from robojackson.report.plots.run_plots import png  # matplotlib: only when something is drawn

    made = []
    for name, by_key in figures.items():
        if any(by_key.get((move, setup)) for move in moves for setup in setups):
            title, _, _ = FIGURES[name]
            caption = "A dot a seed, the bar their mean; lines are policies that learnt nothing."
            drawn = evaluation_figure(name, by_key, baselines, moves, setups)
            made.append(Plot(title, caption, png(drawn)))
    return made


def evaluation_figure(
    name: str,
    by_key: BySeed,
    baselines: Mapping[str, Mapping[str, Mapping[str, float]]],
    moves: Sequence[str],
    setups: Sequence[str],
) -> "Figure":
    """Draw one figure of the evaluation, in the unit of its title (`FIGURES`).

    Args:
        name: Name of the figure.
        by_key: Its values of the seeds.
        baselines: As in `evaluation_plots`.
    """
    from robojackson.report.plots.study_plots import evaluation_plot  # matplotlib

    title, _, factor = FIGURES[name]
    by_move: dict[str, dict[str, list[float]]] = {
        move: {setup: [factor * v for v in by_key.get((move, setup), {}).values()]
               for setup in setups}
        for move in moves
    }  # fmt: skip
    lines = {
        move: {p: factor * known[name] for p, known in found.items() if name in known}
        for move, found in baselines.items()
    }
    return evaluation_plot(by_move, lines, title)
