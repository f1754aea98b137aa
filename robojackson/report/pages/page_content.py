"""From the results of the stages to the content of the page: figures, plots and versions."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from importlib import metadata
from typing import Any

import numpy as np
from jaxtyping import Float

from robojackson.clips.quality.advice import Advice
from robojackson.clips.quality.stability import Stability
from robojackson.clips.video import VideoInfo
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.motion.smpl_sequence import AIR, PLANTED, SmplSequence
from robojackson.report.pages.run_page import PageContent, Plot, dancer_of
from robojackson.report.plots import run_plots
from robojackson.report.plots.feasibility_plot import feasibility_strip

PROGRAMS = ("robojackson", "mujoco", "gymnasium", "mediapipe", "torch", "jax", "sbx-rl",
            "sb3-contrib", "prefect", "numpy")  # fmt: skip

SHOWN_FINDINGS = 3


@dataclass(frozen=True)
class Results:
    """What a run made.

    Attributes:
        title: Of the dance.
        info: Of the source clip.
        stability: Of the source clip, or None.
        sequence: The recovered person.
        reference: The reference motion.
        training: trainer, seed, steps, updates, training_s, setup: what is known.
        episodes: Rows of EpisodeRecord.
        evaluation: Summary of the evaluation, its baselines inside.
        evaluations: Rows of EvaluationRecord.
        rollout_qpos: The trained robot from the first step, or None.
        advice: What to do better when the clip is filmed again.
        tracker_video: Name of the film of a tracker beside a trained robot, or None.
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
    rollout_qpos: Float[np.ndarray, "S nq"] | None
    advice: Sequence[Advice] = ()
    tracker_video: str | None = None


def page_content(results: Results, video: str | None) -> PageContent:
    """The page of a run; `video` is the mp4's address relative to the page."""
    return PageContent(
        title=results.title,
        source=_source(results.info),
        stability=asdict(results.stability) if results.stability else {},
        mocap=_mocap(results.sequence),
        scorecard=results.reference.scorecard,
        training=results.training,
        evaluation=results.evaluation,
        video=video,
        tracker_video=results.tracker_video,
        plots=_plots(results),
        versions=versions(),
        notes=results.sequence.notes,
        advice=[str(each) for each in results.advice],
    )


def versions(programs: Sequence[str] = PROGRAMS) -> dict[str, str]:
    """Installed versions; a program that is not installed is left out."""
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
            "Mean survival from every start phase: a low bar is a moment at which it cannot begin."
        )
        made.append(_plot("Survival by start phase", caption, figure))
    if any(key.startswith("limb_gain_") for key in results.evaluation):
        figure = run_plots.limb_gains(results.evaluation)
        caption = (
            "Velocity of head, hands and feet along the reference's, pelvis frame: "
            "left blue, right orange, head green."
        )
        made.append(_plot("How lively the limbs are", caption, figure))
    if results.rollout_qpos is not None and len(results.rollout_qpos):
        figure = run_plots.joint_tracking(reference, results.rollout_qpos)
        caption = "The six hinges that move most: grey the reference, blue the robot in simulation."
        made.append(_plot("Joint tracking", caption, figure))
    figure = run_plots.contact_strip(results.sequence, reference)
    made.append(_plot("Contacts", "Feet on the floor, of the person and of the robot.", figure))
    return made + _dynamics(reference)


def _dynamics(reference: ReferenceMotion) -> list[Plot]:
    """What the motion asks of the robot's motors and feet."""
    made = []
    if reference.certificate is not None:
        caption = (
            "What neither the feet's pushes nor the motors can give, in tolerances: feasible up to "
            "the dashed line. Below, the tempo beside the clip."
        )
        findings = reference.certificate.findings
        if findings:
            caption += " " + "; ".join(str(finding) for finding in findings[:SHOWN_FINDINGS]) + "."
        made.append(_plot("Can the robot do it?", caption, feasibility_strip(reference)))
    if reference.torque_ratio.shape[1] == len(reference.joint_names):
        figure = run_plots.torque_heat_map(reference, reference.joint_names)
        made.append(_plot("Torques", "What each motor has to give, over its limit.", figure))
    return made


def _plot(title: str, caption: str, figure: Any) -> Plot:
    return Plot(title, caption, run_plots.png(figure))
