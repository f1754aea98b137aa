"""Run one stage at a time, from files to files, without importing Prefect.

Each function calls the public API, writes its results into a folder and returns the figures of the
command's answer. Heavy libraries are imported inside.
"""

import json
import time
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from robojackson.cli import cards, console, mocap_card
from robojackson.cli.lifetime.video_process import in_video_process, probed
from robojackson.errors import BadConfiguration, NoPersonFound, RejectedReference, TrackTooShort
from robojackson.files.file_tree import results_in
from robojackson.files.json_types import to_json_types
from robojackson.pipeline.yaml_loader import load
from robojackson.rl.config.evaluate_config import REGULATOR
from robojackson.rl.evaluation.verdict import NEEDS_FULL_LENGTH

if TYPE_CHECKING:
    from robojackson.api.motions import LoadedNetworks
    from robojackson.clips.quality.advice import Kind
    from robojackson.motion.landmark_track import LandmarkTrack
    from robojackson.motion.smpl_sequence import SmplSequence
    from robojackson.pipeline.pipeline_config import PipelineConfig

LONGER_MINUTES = 20
"""Least budget advised for the next training of a robot that does not dance, minutes."""
ALONE: "Kind" = "person_missing"
"""Advice about one camera alone: where another one sees the person, none is missing."""
Figures = dict[str, Any]
Overrides = Mapping[str, Any]


def mocap(
    video: Path,
    out: Path,
    config: str,
    overrides: Overrides,
    hypotheses: int = 0,
    second: Path | None = None,
    start_s: float | None = None,
    whole: Path | None = None,
) -> Figures:
    """Write landmarks.parquet and smpl.parquet of a video or two, and smpl_1... of hypotheses.

    Args:
        start_s: Where the clip begins in the video that was given: advice is about that.
        whole: The video that was given, where `video` is a range of it.
    """
    from robojackson.api.hypotheses import hypothesis_files, sample_hypotheses
    from robojackson.api.motions import load_weights
    from robojackson.cli.pictures import motion_source
    from robojackson.clips.quality.advice import advise
    from robojackson.pipeline.pipeline_config import PipelineConfig

    began = time.monotonic()
    settings = load(PipelineConfig, config, overrides)
    names = hypothesis_files(settings, hypotheses)
    if second and (names or settings.network.hybrik):
        raise BadConfiguration("two cameras exclude --hypotheses and --hybrik: omit these options")
    networks = load_weights(settings.network)
    with results_in(out) as files:
        track = _track_of(video, settings, start_s or 0.0)
        sequence = _motion_of(track, video, second, settings, networks)
        motions = {"smpl.parquet": sequence.to_bytes()}
        for name, other in sample_hypotheses(track, settings, hypotheses):
            motions[name] = other.to_bytes()
        landmarks = track.to_bytes()
        record = motion_source.source_record(video, landmarks, motions, whole)
        made = {**motions, "landmarks.parquet": landmarks, motion_source.FILE: record}
        for name, content in made.items():
            files.write(name, content)
    return {
        "video": str(video),
        "smpl": str(out / "smpl.parquet"),
        "hypotheses": [str(out / name) for name in names],
        "landmarks": str(out / "landmarks.parquet"),
        "frames": len(sequence),
        "fps": sequence.fps,
        "detected": int(sequence.valid.sum()),
        "person": max(track.person, 1),
        "floor": mocap_card.floor_figures(sequence),
        "contact_share": mocap_card.contact_shares(sequence),
        "notes": list(sequence.notes),
        "advice": [
            each.record
            for each in advise(track, start_s or 0.0)
            if second is None or each.kind != ALONE
        ],
        "next": cards.command_line("retarget", out / "smpl.parquet", "-o", out),
        "seconds": time.monotonic() - began,
    }


def _track_of(video: Path, settings: "PipelineConfig", begin_s: float = 0.0) -> "LandmarkTrack":
    """Return the landmarks of a video that begins at a moment of the one that was given, found in a
    process of its own."""
    from robojackson.mocap.landmarks.landmark_pipeline import detect_landmarks

    info = replace(probed(video, settings.video), begin_s=begin_s)
    with console.bar(f"landmarks of {video.name}") as progress:
        return in_video_process(
            detect_landmarks, video, info, settings.detector, settings.dancer,
            frames=info.frames, progress=progress,
        )  # fmt: skip


def _motion_of(
    track: "LandmarkTrack",
    video: Path,
    second: Path | None,
    settings: "PipelineConfig",
    networks: "LoadedNetworks | None",
) -> "SmplSequence":
    """Return the motion of a track, or of it and what a second camera sees."""
    from robojackson.api.motions import recover_motion
    from robojackson.api.second_camera import heard_offset
    from robojackson.mocap.views.two_cameras import recover_together

    try:
        if second is None:
            return recover_motion(
                track, config=settings.mocap, networks=networks, video=video, progress=True
            )
        heard_s = in_video_process(heard_offset, video, second)
        return recover_together(track, _track_of(second, settings), settings.mocap, heard_s)
    except (NoPersonFound, TrackTooShort) as cause:
        named = second if second and track.detected.sum() > 1 else video
        raise type(cause)(cause.reason, named) from cause


def retarget(smpl: Path, out: Path, config: str, overrides: Overrides) -> Figures:
    """Write reference.parquet and scorecard.json of a motion, good or bad; `gate` evaluates it."""
    from robojackson.api.motions import retarget_motion
    from robojackson.api.robots import load_robot
    from robojackson.cli.training_words import next_of_retargeting
    from robojackson.motion.smpl_sequence import SmplSequence
    from robojackson.pipeline.pipeline_config import PipelineConfig
    from robojackson.retarget.scorecard_gate import scorecard_record

    began = time.monotonic()
    settings = load(PipelineConfig, config, overrides)
    robot = load_robot(settings.robot)
    sequence = SmplSequence.load(smpl)
    with results_in(out) as files:
        try:
            reference = retarget_motion(sequence, robot, config=settings.retarget)
        except TrackTooShort as cause:
            raise TrackTooShort(cause.reason, smpl) from cause
        files.write("reference.parquet", reference.to_bytes())
        scorecard = to_json_types(scorecard_record(reference))
        files.write("scorecard.json", json.dumps(scorecard, indent=1).encode())
    return {
        "reference": str(out / "reference.parquet"),
        "robot": reference.robot,
        "method": settings.retarget.method,
        "steps": len(reference),
        "dt": reference.dt,
        "cyclic": reference.cyclic,
        "scorecard": scorecard,
        "verdict": cards.retarget_verdict(scorecard),
        **next_of_retargeting(out / "reference.parquet", scorecard, robot, settings.train),
        "seconds": time.monotonic() - began,
    }


def gate(scorecard: Figures, out: Path, config: str, overrides: Overrides) -> None:
    """Raise for a motion that training cannot follow; its files stay.

    Raises:
        RejectedReference: the message names the figure and a remedy.
    """
    from robojackson.pipeline.pipeline_config import PipelineConfig
    from robojackson.retarget.scorecard_gate import check

    if not load(PipelineConfig, config, overrides).gate:
        return
    try:
        check(scorecard)
    except RejectedReference as cause:
        raise cause.saved_in(out) from None


def evaluate(
    policy: Path,
    reference: Path,
    out: Path | None,
    config: str,
    overrides: Overrides,
    robot: str | None = None,
) -> Figures:
    """Evaluate a policy or a tracker; with a folder, also write its tables and the rollout."""
    from robojackson.api.evaluation import evaluate_policy
    from robojackson.api.trackers import load_tracker
    from robojackson.cli.trackers.named_tracker import is_tracker
    from robojackson.cli.training_words import is_fed_onboard, pack_of, train_after, train_this
    from robojackson.pipeline.pipeline_config import PipelineConfig

    settings = load(PipelineConfig, config, overrides)
    tracker = load_tracker(str(policy)) if is_tracker(policy) else None
    with console.stages() as progress:
        verdict = evaluate_policy(
            tracker or policy, reference, robot, config=settings.evaluate, setup=settings.setup,
            progress=progress,
        )  # fmt: skip
    if out is not None:
        verdict.save(out)
    summary = to_json_types(verdict.summary)
    if tracker is not None:
        estimated = tracker.description.root_state == "estimated"
        packed = pack_of(policy, reference, out, robot)
        following = packed if estimated else train_this(reference, robot)
    elif summary["verdict"]["kind"] == "dances" and is_fed_onboard(policy):
        following = pack_of(policy, reference, out, robot)
    elif summary["verdict"]["kind"] == "dances":
        words = ("export", policy, "--to", "onnx", "-o", policy.with_suffix(".onnx"))
        following = cards.command_line(*words)
    else:
        following = train_after(policy, reference, LONGER_MINUTES, robot)
    return {"policy": str(policy), "reference": str(reference), **summary, "next": following}


VERDICT = ("survived_s", "success", "strict_success", "skill", "site_error_m", "limb_gain")


def verdict_lines(evaluation: Mapping[str, Any]) -> list[str]:
    """Return the table of an evaluation: the policy, the feedback that it was trained on top of,
    then the baselines."""
    name = evaluation.get("tracker", "trained")
    alone = evaluation.get("variants", {}).get(REGULATOR) if name == "trained" else None
    fed = {"feedback alone": alone} if alone else {}
    rows = {name: evaluation, **evaluation.get("trackers", {}), **fed, **evaluation["baselines"]}
    if evaluation.get("verdict", {}).get("kind") == "too_short":
        shown = dict.fromkeys(NEEDS_FULL_LENGTH, "too short")
        rows = {name: {**row, **shown} for name, row in rows.items()}
    return console.table(rows, VERDICT)
