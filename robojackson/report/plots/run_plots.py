"""Plots of one run: training, evaluation, contacts, torques and tracking, as matplotlib figures.

Colours and texts are readable on white and on black: the page is either. Rows are dictionaries with
the columns of EpisodeRecord and EvaluationRecord (`pipeline.table_schemas`).
"""

import io
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from jaxtyping import Float, Int
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.image import AxesImage

from robojackson.files.json_types import number_of
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.motion.smpl_sequence import CONTACT_POINTS, SmplSequence
from robojackson.report.quantities import POLICY_TITLES, decimal
from robojackson.rl.config.evaluate_config import TRAINED, VARIANTS

Row = Mapping[str, Any]
INK = "#8a919c"
ACCENT, SECOND, GOOD, WARM = "#3b82f6", "#f59e42", "#3fae6b", "#e0607e"
BASELINE_COLOURS = {
    "statue": "#a78bfa", "mean_pose": "#e879b9", "zero_residual": GOOD, "random": "#9aa3b2",
}  # fmt: skip
BINS = 60
LABEL = 0.12
"""Width of a bar's figure, as a gain."""
TORQUE_SHOWN = 2.0
"""Largest torque of the colour scale, as a multiple of the limit."""
TORQUE_COLOURS = ((0.0, "#8080801a"), (0.5, ACCENT), (0.5, SECOND), (1.0, "#b3123a"))
STATE_COLOURS = {0: (0.5, 0.5, 0.5, 0.15), 1: (0.25, 0.68, 0.42, 0.95), 2: (0.96, 0.62, 0.26, 0.95)}
"""Colours of contact states: air, planted, sliding."""


def training_curve(episodes: Sequence[Row], dt: float) -> Figure:
    """Plot length and return of the training episodes against control steps: median and
    quartiles."""
    figure, (top, bottom) = figure_of(7.0, 4.2, rows=2, sharex=True)
    steps = np.array([row["step"] for row in episodes], float)
    lengths = np.array([row["episode_length"] for row in episodes], float) * dt
    returns = np.array([row["episode_return"] for row in episodes], float)
    _band(top, steps, lengths, ACCENT)
    _band(bottom, steps, returns, SECOND)
    top.set_ylabel("episode, s")
    bottom.set_ylabel("return")
    bottom.set_xlabel("control steps")
    bottom.ticklabel_format(axis="x", style="sci", scilimits=(-3, 4))
    return figure


def survival_by_phase(
    rows: Sequence[Row], dt: float, dancer: str = POLICY_TITLES[TRAINED][0]
) -> Figure:
    """Plot the mean survival from each start phase: the dancer as bars below a mark where its
    rollouts end, under another control law as a dashed line, its baselines as lines.
    """
    figure, (axes,) = figure_of(7.0, 2.8)
    for policy in dict.fromkeys(str(row["policy"]) for row in rows):
        chosen = [row for row in rows if row["policy"] == policy and row["phase"] >= 0]
        phases = np.array(sorted({int(row["phase"]) for row in chosen}))
        mean = [np.mean([r["survived_s"] for r in chosen if r["phase"] == p]) for p in phases]
        title = POLICY_TITLES.get(policy, (policy.replace("_", " "), ""))[0]
        if policy == TRAINED:
            width = 0.8 * dt * float(np.diff(phases).min()) if len(phases) > 1 else 0.1
            place = phases * dt
            axes.bar(place, mean, width, align="edge", color=ACCENT, label=dancer)
            whole = [max(_whole_s(r) for r in chosen if r["phase"] == p) for p in phases]
            axes.hlines(whole, place, place + width, color=INK, lw=1, label="to the end")
        elif policy in VARIANTS:
            title = f"{dancer}, {title}"
            axes.plot(phases * dt, mean, ".--", lw=1, color=SECOND, label=title)
        else:
            colour = BASELINE_COLOURS.get(policy, INK)
            axes.plot(phases * dt, mean, ".-", lw=1, color=colour, label=title)
    axes.set_xlabel("start phase, s into the dance")
    axes.set_ylabel("survival, s")
    legend(axes)
    return figure


def _whole_s(row: Row) -> float:
    """Return how long a rollout is from which no robot falls, seconds; 0 where it fell at once."""
    share = float(row["clip_fraction"])
    return float(row["survived_s"]) / share if share else 0.0


def limb_gains(summary: Mapping[str, Any]) -> Figure:
    """Plot the velocity gain of each limb end beside its reference; 1 is the whole amplitude.

    A limb without a gain, NaN or None, does not move in the reference.
    """
    figure, (axes,) = figure_of(7.0, 2.4)
    prefix = "limb_gain_"
    found = {key: value for key, value in summary.items() if key.startswith(prefix)}
    gains = {key.removeprefix(prefix): number_of(value) for key, value in found.items()}
    names = [name.replace("_", " ") for name in gains]
    values = np.nan_to_num(np.array(list(gains.values())))
    axes.barh(names, values, color=[_side_colour(name) for name in gains])
    for index, value in enumerate(gains.values()):
        text = decimal(value, 2) if np.isfinite(value) else "does not move in the reference"
        end = max(value, 0.0) if np.isfinite(value) else 0.0
        if 1.0 - LABEL < end < 1.0:
            end = 1.0  # beside the line, not over it
        axes.text(end, index, f" {text}", va="center", color=INK, fontsize=8)
    axes.axvline(1.0, color=INK, lw=1, ls="--")
    axes.set_xlim(min(0.0, values.min(initial=0.0)), max(1.3, values.max(initial=0.0) * 1.15))
    axes.set_xlabel("velocity gain (1 = as in the reference)")
    axes.invert_yaxis()
    return figure


def contact_strip(sequence: SmplSequence, reference: ReferenceMotion) -> Figure:
    """Plot when the person's heels and toes, and the robot's feet, are planted, slide or are in the
    air.

    Both use the robot's clock: a motion that was slowed down shows each moment under itself.
    """
    figure, (human, robot) = figure_of(7.0, 2.8, rows=2)
    names = [name.replace("_", " ") for name in CONTACT_POINTS]
    shown = np.round(np.asarray(reference.source_time_s) * sequence.fps).astype(int)
    shown = np.clip(shown, 0, len(sequence) - 1)
    _strip(human, sequence.contact[shown], names, len(reference) * reference.dt)
    contacts = [name.replace("_", " ") for name in reference.contact_names]
    _strip(robot, reference.contact, contacts, len(reference) * reference.dt)
    human.set_title("person", loc="left", fontsize=9, color=INK)
    robot.set_title("reference robot", loc="left", fontsize=9, color=INK)
    robot.set_xlabel("time, s (green: planted, orange: sliding, grey: in the air)")
    return figure


def torque_heat_map(reference: ReferenceMotion, motors: Sequence[str]) -> Figure:
    """Plot |torque| over its limit, a row a motor: blue within the limit, orange to red beyond.

    Args:
        motors: Names of the hinges, as the columns of `torque_ratio`.
    """
    ratio = np.asarray(reference.torque_ratio).T
    figure, (axes,) = figure_of(7.0, 0.8 + 0.2 * len(motors))
    colours = LinearSegmentedColormap.from_list("torque", list(TORQUE_COLOURS))
    extent = (0.0, len(reference) * reference.dt, len(motors) - 0.5, -0.5)
    picture = axes.imshow(ratio, aspect="auto", interpolation="nearest", extent=extent,
                          cmap=colours, vmin=0.0, vmax=TORQUE_SHOWN)  # fmt: skip
    over = 100.0 * (ratio > 1.0).mean(axis=1)
    axes.set_yticks(
        range(len(motors)),
        [
            f"{name.replace('_', ' ')}  {share:.0f} %"
            for name, share in zip(motors, over, strict=True)
        ],
    )
    axes.set_xlabel("time, s")
    axes.grid(visible=False)
    _torque_bar(figure, picture, bool((ratio > TORQUE_SHOWN).any()))
    return figure


def png(figure: Figure, dpi: int = 160, opaque: bool = False) -> bytes:
    """Return the figure as a picture, with a transparent background unless it is to be opaque."""
    buffer = io.BytesIO()
    FigureCanvasAgg(figure)
    figure.savefig(buffer, format="png", dpi=dpi, transparent=not opaque)
    return buffer.getvalue()


def figure_of(
    width: float, height: float, rows: int = 1, columns: int = 1, sharex: bool = False
) -> tuple[Figure, list[Axes]]:
    """Return an empty figure of panels in our style; sizes in inches."""
    figure = Figure(figsize=(width, height), layout="constrained")
    grid = figure.subplots(rows, columns, sharex=sharex, squeeze=False)
    axes = list(grid.ravel())
    for panel in axes:
        panel.tick_params(colors=INK, labelsize=8)
        panel.xaxis.label.set_color(INK)
        panel.yaxis.label.set_color(INK)
        panel.grid(color=INK, alpha=0.18, lw=0.6)
        panel.set_axisbelow(True)
        for name, spine in panel.spines.items():
            spine.set_visible(name in ("left", "bottom"))
            spine.set_color(INK)
    return figure, axes


def _band(axes: Axes, x: Float[np.ndarray, " N"], y: Float[np.ndarray, " N"], colour: str) -> None:
    """Draw median and quartiles of y over equal shares of x."""
    if not len(x):
        return
    edges = np.linspace(x.min(), x.max() + 1e-9, min(BINS, len(x)) + 1)
    place = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, len(edges) - 2)
    filled = [index for index in range(len(edges) - 1) if (place == index).any()]
    quartiles = np.array([np.quantile(y[place == index], (0.25, 0.5, 0.75)) for index in filled])
    middle = (edges[filled] + edges[np.array(filled) + 1]) / 2
    axes.fill_between(middle, quartiles[:, 0], quartiles[:, 2], color=colour, alpha=0.22, lw=0)
    axes.plot(middle, quartiles[:, 1], color=colour, lw=1.6)


def _strip(axes: Axes, contact: Int[np.ndarray, "T C"], names: Iterable[str], end_s: float) -> None:
    colours = np.array([STATE_COLOURS[state] for state in range(len(STATE_COLOURS))])
    labels = list(names)
    picture = colours[np.asarray(contact).T]
    extent = (0.0, end_s, len(labels) - 0.5, -0.5)
    axes.imshow(picture, aspect="auto", interpolation="nearest", extent=extent)
    axes.set_yticks(range(len(labels)), labels)
    axes.grid(visible=False)


def _torque_bar(figure: Figure, picture: AxesImage, cut: bool) -> None:
    bar = figure.colorbar(picture, extend="max" if cut else "neither", pad=0.02)
    bar.set_label("|torque| / limit", color=INK, fontsize=8)
    bar.ax.tick_params(colors=INK, labelsize=8)


def _side_colour(name: str) -> str:
    """Return blue for left, orange for right, another colour for the head."""
    if "right" in name:
        return SECOND
    return ACCENT if "left" in name else GOOD


def legend(axes: Axes) -> None:
    """Draw the names of the lines above the panel."""
    axes.legend(fontsize=7, labelcolor=INK, frameon=False, ncols=5, loc="lower center",
                bbox_to_anchor=(0.5, 1.0))  # fmt: skip
