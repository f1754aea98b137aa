"""Content of the page from the results of the stages: figures, plots and versions."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from importlib import metadata
from typing import Any

import numpy as np

from robojackson.clips.quality.advice import Advice
from robojackson.clips.quality.stability import Stability
from robojackson.clips.video import VideoInfo
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.motion.smpl_sequence import AIR, PLANTED, SmplSequence
from robojackson.report.pages.evaluation_text import Verdict, dancer_of, next_step
from robojackson.report.pages.limb_figures import limb_rows
from robojackson.report.pages.run_page import PageCandidate, PageContent, Plot
from robojackson.report.plots import run_plots
from robojackson.report.plots.feasibility_plot import feasibility_strip
from robojackson.report.web.player_data import Player

PROGRAMS = ("robojackson", "mujoco", "gymnasium", "mediapipe", "torch", "jax", "sbx-rl",
            "sb3-contrib", "prefect", "numpy")  # fmt: skip

TO_COME = (
    "This is a first look. Load this page again for the video and the evaluation from all starts."
)
"""Note on a page that has no video yet."""
SHOWN_FINDINGS = 3
NOTHING = 0.01
"""Slack that is too small to be seen, tolerances."""


@dataclass(frozen=True)
class Results:
    """The results of a run.

    Attributes:
        title: Title of the dance.
        info: Facts of the source clip.
        stability: Stability of the source clip, or None.
        sequence: The recovered person.
        reference: The reference motion.
        training: trainer, seed, steps, updates, training_s, setup, as far as known.
        episodes: Rows of EpisodeRecord.
        evaluation: Summary of the evaluation, including its baselines.
        evaluations: Rows of EvaluationRecord.
        advice: Advice for filming the clip again.
        tracker_video: Name of the film of a tracker beside a trained robot, or None.
        player: Player of the page, or None.
        film, has_sound: Its source pane (mp4), and whether it has audible sound.
        live: Name of the live dance, or None.
        candidates: Clips that were scored.
        beats: Beats of motions and music.
        provenance: Digests of the results, by name.
        settings: The configuration, as YAML.
        longer: Options of `dance` for a longer training.
    """

    title: str
    info: VideoInfo
    stability: Stability | None
    sequence: SmplSequence
    reference: ReferenceMotion
    training: Mapping[str, Any]
    episodes: Sequence[Mapping[str, Any]]
    evaluation: Mapping[str, Any]
    evaluations: Sequence[Mapping[str, Any]]
    advice: Sequence[Advice] = ()
    tracker_video: str | None = None
    player: Player | None = None
    film: bytes = b""
    has_sound: bool = False
    live: str | None = None
    candidates: Sequence[PageCandidate] = ()
    beats: Sequence[Verdict] = ()
    provenance: Mapping[str, str] = field(default_factory=dict)
    settings: str = ""
    longer: str = ""


def page_content(results: Results, video: str | None) -> PageContent:
    """Return the page of a run.

    Args:
        video: Address of the mp4 relative to the page; None where it is still to come.
    """
    return PageContent(
        title=results.title,
        robot=results.reference.robot,
        source=_source(results.info),
        stability=asdict(results.stability) if results.stability else {},
        mocap=_mocap(results.sequence),
        scorecard=_scorecard(results.reference.scorecard),
        training=results.training,
        evaluation=results.evaluation,
        video=video,
        tracker_video=results.tracker_video,
        plots=_plots(results),
        versions=versions(),
        notes=[*([] if video else [TO_COME]), *results.sequence.notes],
        advice=[str(each) for each in results.advice],
        player=results.player,
        film=results.film,
        has_sound=results.has_sound,
        live=results.live,
        candidates=results.candidates,
        limbs=limb_rows(results.sequence, results.reference, results.player, results.evaluation),
        beats=results.beats,
        provenance=results.provenance,
        settings=results.settings,
        next_step=next_step(results.evaluation, results.longer),
    )


def versions(programs: Sequence[str] = PROGRAMS) -> dict[str, str]:
    """Return installed versions; a program that is not installed is left out."""
    found = {}
    for name in programs:
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            continue
    return found


def _source(info: VideoInfo) -> dict[str, object]:
    return {
        "file": info.path.name,
        "size": f"{info.width} × {info.height}",
        "frames": info.frames,
        "fps": info.fps,
        "duration_s": info.duration_s,
    }


def _mocap(sequence: SmplSequence) -> dict[str, object]:
    rest = sequence.rest_joints
    return {
        "frames": len(sequence),
        "valid_share": float(np.mean(sequence.valid)),
        "height_m": float(np.ptp(rest[:, 1])),
        "contact_share": float((sequence.contact != AIR).any(1).mean()),
        "planted_share": float((sequence.contact == PLANTED).any(1).mean()),
    }


def _plots(results: Results) -> list[Plot]:
    reference, made = results.reference, []
    if results.episodes:
        figure = run_plots.training_curve(results.episodes, reference.dt)
        made.append(_plot("Training", "Median and quartiles of the training episodes.", figure))
    if results.evaluations:
        dancer = dancer_of(results.evaluation)
        figure = run_plots.survival_by_phase(results.evaluations, reference.dt, dancer)
        caption = (
            "Mean survival from every start phase: where a bar is far below the end of its "
            "rollouts, the robot cannot begin."
        )
        made.append(_plot("Survival by start phase", caption, figure))
    if any(key.startswith("limb_gain_") for key in results.evaluation):
        figure = run_plots.limb_gains(results.evaluation)
        caption = (
            "Velocity of head, hands and feet along the reference's, pelvis frame: "
            "left blue, right orange, head green."
        )
        made.append(_plot("How lively the limbs are", caption, figure))
    return made + _dynamics(reference)


def _dynamics(reference: ReferenceMotion) -> list[Plot]:
    """Plot the torques and forces that the motion needs."""
    made = []
    if reference.certificate is not None:
        caption = (
            "Force that neither feet nor motors can supply, in tolerances: feasible up to "
            "the dashed line (green), beyond it at a slower tempo (orange) or not at all (red). "
            "Below, the tempo beside the clip."
        )
        if float(reference.certificate.slack.max(initial=0.0)) < NOTHING:
            caption = "Nothing is missing: feet and motors supply all forces. " + caption
        findings = reference.certificate.findings
        if findings:
            caption += " " + "; ".join(str(finding) for finding in findings[:SHOWN_FINDINGS]) + "."
        made.append(_plot("Can the robot do it?", caption, feasibility_strip(reference)))
    if reference.torque_ratio.shape[1] == len(reference.joint_names):
        figure = run_plots.torque_heat_map(reference, reference.joint_names)
        caption = (
            "Required torque of each motor, over its limit; beside the names the share of the time "
            "over it."
        )
        made.append(_plot("Torques", caption, figure))
    return made


def _plot(title: str, caption: str, figure: Any) -> Plot:
    return Plot(title, caption, run_plots.png(figure))


def _scorecard(card: Mapping[str, float]) -> dict[str, float]:
    """Return the score card with tempos beside the clip's, whatever tempo was given."""
    given = card.get("tempo", 1.0)
    return {**card, **{name: given * card[name] for name in ("tempo_mean", "tempo_min")
                       if name in card}}  # fmt: skip
