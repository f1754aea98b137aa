"""The feasibility strip: the steps of a reference motion that the robot can do, and the tempo."""

import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.report.plots.run_plots import ACCENT, GOOD, INK, SECOND, figure_of

BAD = "#b3123a"
SHOWN_SLACK = 3.0
"""Largest slack that is drawn, tolerances."""


def feasibility_strip(reference: ReferenceMotion) -> Figure:
    """Draw the slack of every step, coloured by its remedy, above the tempo beside the clip, which
    has none in the stands and steps around the clip.

    Raises:
        ValueError: the motion has no certificate.
    """
    if reference.certificate is None:
        raise ValueError("the motion has no certificate")
    figure, (top, bottom) = figure_of(7.0, 3.0, rows=2, sharex=True)
    time_s = np.arange(len(reference)) * reference.dt
    _slack(top, time_s, reference)
    tempo = _tempo(reference)
    bottom.plot(time_s, tempo, color=ACCENT, lw=1.6)
    bottom.set_ylim(0.0, max(1.1, 1.05 * float(np.nan_to_num(tempo).max())))
    bottom.set_ylabel("tempo")
    bottom.set_xlabel("time, s")
    return figure


def _tempo(reference: ReferenceMotion) -> Float[np.ndarray, " S"]:
    """Return the tempo beside the clip at every step; NaN where the clip does not go on."""
    found, times = np.full(len(reference), np.nan), np.asarray(reference.source_time_s)
    if (inside := reference.in_clip).any():
        found[inside] = np.gradient(times[inside], reference.dt)
    return found


def _slack(axes: Axes, time_s: np.ndarray, reference: ReferenceMotion) -> None:
    certificate = reference.certificate
    assert certificate is not None
    slack = np.asarray(certificate.slack)
    helped = np.asarray(certificate.tempo) > 0
    colours = np.where(slack <= 1.0, GOOD, np.where(helped, SECOND, BAD))
    axes.bar(time_s, np.minimum(slack, SHOWN_SLACK), 1.05 * reference.dt, align="edge",
             color=colours.tolist(), lw=0)  # fmt: skip
    axes.axhline(1.0, color=INK, lw=1, ls="--")
    axes.set_ylim(0.0, max(1.2, min(SHOWN_SLACK, 1.1 * float(slack.max()))))
    axes.set_ylabel("slack")
