"""One stage at a time, from files to files, with no Prefect in memory.

Each function reads its inputs, calls one function of `robojackson`, writes its tables into a folder
and returns the figures that the command answers with. Heavy libraries are imported inside.
"""

import json
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from robojackson.cli import console
from robojackson.errors import (
    NoPersonFound,
    RejectedReference,
    StoreError,
    TrackTooShort,
)
from robojackson.pipeline import tables
from robojackson.pipeline.file_tree import FileTree
from robojackson.pipeline.robot_descriptions import describe_robot
from robojackson.pipeline.run_names import run_name
from robojackson.pipeline.yaml_loader import load

if TYPE_CHECKING:
    from robojackson.motion.reference_motion import ReferenceMotion
    from robojackson.motion.smpl_sequence import SmplSequence
    from robojackson.robot.model import Robot

Figures = dict[str, Any]
Overrides = Mapping[str, Any]
Value = TypeVar("Value")


def mocap(
    video: Path, out: Path, config: str, overrides: Overrides, hypotheses: int = 0
) -> Figures:
    """landmarks.parquet and smpl.parquet of a video, smpl_1.parquet... of what else it allows."""
    from robojackson.api.hypotheses import hypothesis_files, sample_hypotheses
    from robojackson.api.motion_recovery import motion_recoverer
    from robojackson.clips.video import probe
    from robojackson.mocap.landmarks.landmark_pipeline import detect_landmarks
    from robojackson.pipeline.pipeline_config import PipelineConfig

    began = time.monotonic()
    settings = load(PipelineConfig, config, overrides)
    names = hypothesis_files(settings, hypotheses)
    info = probe(video, settings.video)
    to_motion = motion_recoverer(video, settings, console.bar)
    with results_in(out) as files:
        with console.bar(f"landmarks of {video.name}") as progress:
            track = detect_landmarks(video, info, settings.detector, settings.dancer, progress)
        try:
            sequence = to_motion(track)
        except (NoPersonFound, TrackTooShort) as cause:
            raise type(cause)(cause.reason, video) from cause
        files.write("landmarks.parquet", tables.encode(track))
        files.write("smpl.parquet", tables.encode(sequence))
        for name, other in sample_hypotheses(track, settings, hypotheses):
            files.write(name, tables.encode(other))
    return {
        "video": str(video),
        "smpl": str(out / "smpl.parquet"),
        "hypotheses": [str(out / name) for name in names],
        "landmarks": str(out / "landmarks.parquet"),
        "frames": len(sequence),
        "fps": sequence.fps,
        "detected": int(track.detected.sum()),
        "person": track.person,
        "floor": _floor(sequence),
        "contact_share": _contact_share(sequence),
        "notes": list(sequence.notes),
        "seconds": time.monotonic() - began,
    }


def retarget(smpl: Path, out: Path, config: str, overrides: Overrides) -> Figures:
    """reference.parquet and scorecard.json of a motion, good or bad; `gate` tells which."""
    from robojackson.motion.smpl_sequence import SmplSequence
    from robojackson.pipeline.pipeline_config import PipelineConfig
    from robojackson.retarget.retargeting import retarget_motion
    from robojackson.retarget.scorecard_gate import scorecard_record

    began = time.monotonic()
    settings = load(PipelineConfig, config, overrides)
    machine = _robot(settings.robot)
    sequence = read_table(SmplSequence, smpl)
    with results_in(out) as files:
        try:
            reference = retarget_motion(sequence, machine, settings.retarget)
        except TrackTooShort as cause:
            raise TrackTooShort(cause.reason, smpl) from cause
        files.write("reference.parquet", tables.encode(reference))
        scorecard = console.to_json_types(scorecard_record(reference))
        files.write("scorecard.json", json.dumps(scorecard, indent=1).encode())
    return {
        "reference": str(out / "reference.parquet"),
        "robot": reference.robot,
        "method": settings.retarget.method,
        "steps": len(reference),
        "dt": reference.dt,
        "cyclic": reference.cyclic,
        "scorecard": scorecard,
        "seconds": time.monotonic() - began,
    }


def gate(scorecard: Figures, out: Path, config: str, overrides: Overrides) -> None:
    """Refuse a motion that training cannot follow; what was written of it stays.

    Raises:
        RejectedReference: the message names the figure and what would mend it.
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
    policy: Path, reference: Path, out: Path | None, config: str, overrides: Overrides
) -> Figures:
    """The verdict on a policy; with a folder, also its tables and the rollout."""
    from robojackson.motion.reference_motion import ReferenceMotion
    from robojackson.pipeline.pipeline_config import PipelineConfig
    from robojackson.pipeline.table_codecs import Rollout
    from robojackson.pipeline.table_schemas import EVALUATION_RECORD
    from robojackson.rl.evaluation.policy_evaluation import evaluate_policy
    from robojackson.rl.policy import load_policy

    settings = load(PipelineConfig, config, overrides)
    motion = read_table(ReferenceMotion, reference)
    machine = robot_of(motion)
    trained = load_policy(policy)
    with console.stages() as progress:
        verdict = evaluate_policy(trained, motion, machine, settings.evaluate, progress)
    summary = console.to_json_types(verdict.summary)
    if out is not None:
        setup = trained.setup or settings.setup
        common = labels_of(move_of(reference), setup, trained.training["seed"])
        rows = [{**common, **trained.training, **row} for row in verdict.rows]
        with results_in(out) as files:
            files.write("evaluations.parquet", tables.encode_rows(EVALUATION_RECORD, rows))
            files.write("evaluation.json", json.dumps(summary, indent=1).encode())
            files.write("rollout.parquet", tables.encode(Rollout(motion.dt, verdict.rollout_qpos)))
    return {"policy": str(policy), "reference": str(reference), **summary}


def labels_of(move: str, setup: str, seed: int | None) -> Figures:
    """The columns by which episodes and evaluations of a run are joined."""
    move, setup = run_name(move), run_name(setup)
    return {"run_id": f"{move}-{setup}-s{seed}", "move": move, "setup": setup, "seed": seed}


def move_of(reference: Path) -> str:
    """A reference motion is called by its folder when its own name says nothing."""
    path = reference.absolute()
    return path.parent.name if path.stem == "reference" else path.stem


VERDICT = ("survived_s", "success", "strict_success", "skill", "site_error_m", "limb_gain")


def verdict_lines(evaluation: Mapping[str, Any]) -> list[str]:
    """The table of an evaluation: the policy, then its baselines."""
    return console.table({"trained": evaluation, **evaluation["baselines"]}, VERDICT)


def robot_of(reference: "ReferenceMotion") -> "Robot":
    """The robot that a reference motion was made for.

    Raises:
        UnknownName: there is no such robot description.
        RejectedReference: its model has changed since.
    """
    machine = _robot(reference.robot)
    if machine.sha256 != reference.model_sha256:
        raise RejectedReference(
            f"the reference motion was made for another model of {reference.robot!r} "
            f"(sha256 {reference.model_sha256[:12]}..., here {machine.sha256[:12]}...)",
            "retarget the motion again",
        )
    return machine


def _robot(name: str) -> "Robot":
    from robojackson.robot.model import load_robot

    return load_robot(describe_robot(name))


def read_table(cls: type[Value], path: Path) -> Value:
    """A table from a path that a user gave."""
    require_file(path)
    return tables.decode(cls, path.read_bytes(), str(path))


def require_file(path: Path) -> None:
    """Refuse a path that cannot be read as one file.

    Raises:
        StoreError: it is a folder, or not there.
    """
    if path.is_dir():
        raise StoreError(f"{path}: a folder, not a file")
    if not path.is_file():
        raise StoreError(f"{path}: no such file")


@contextmanager
def results_in(out: Path) -> Iterator[FileTree]:
    """A folder for results, told at once when it cannot be written.

    After a failure the folders that were made for it and are empty go away again.
    """
    made = [path for path in (out, *out.parents) if not path.exists()]
    try:
        files = FileTree(out)
        files.require_writable()
        yield files
    except BaseException:
        with suppress(OSError):
            for path in made:
                path.rmdir()
        raise


def _contact_share(sequence: "SmplSequence") -> dict[str, float]:
    from robojackson.motion.smpl_sequence import CONTACT_POINTS, PLANTED

    shares = (sequence.contact == PLANTED).mean(0)
    return dict(zip(CONTACT_POINTS, map(float, shares), strict=True))


def _floor(sequence: "SmplSequence") -> Figures:
    """Where the floor came from and how far the lowest keypoint is from it, metres."""
    lowest = sequence.keypoints_w[:, :, 2].min(1)
    known = {key: sequence.camera[key] for key in ("gravity", "tilt_deg") if key in sequence.camera}
    return {"lowest_keypoint_m": lowest.min(), "median_m": np.median(lowest), **known}
