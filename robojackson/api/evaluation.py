"""Evaluate policies, and render videos of them."""

from collections.abc import Callable
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from robojackson.api.arguments import (
    FilePath,
    Progress,
    RobotLike,
    counter,
    read_if_path,
    require_robot,
    robot_of,
)
from robojackson.api.robots import load_robot
from robojackson.api.trained_policy import TrainedPolicy
from robojackson.clips import video as video_files
from robojackson.clips.video import VideoInfo
from robojackson.errors import BadConfiguration
from robojackson.files import tables
from robojackson.files.file_tree import results_in
from robojackson.files.json_types import to_json
from robojackson.motion.landmark_track import LandmarkTrack
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.motion.rollout import Rollout
from robojackson.motion.smpl_sequence import SmplSequence
from robojackson.pipeline.run_names import motion_name, run_labels
from robojackson.pipeline.table_schemas import EVALUATION_RECORD
from robojackson.pipeline.tracker_descriptions import require_for
from robojackson.report.video.side_by_side import TRAINED_TITLE, VideoConfig, side_by_side
from robojackson.rl.config.evaluate_config import EvaluateConfig
from robojackson.rl.evaluation import policy_evaluation
from robojackson.rl.policy import Policy, load_policy
from robojackson.rl.trackers.tracker import Tracker

PartProgress = Callable[[str, int, int], None]
"""Called with (name of the part, done, in all)."""


@dataclass(frozen=True, repr=False)
class PolicyEvaluation:
    """The evaluation of a policy.

    Attributes:
        summary: Means over its rollouts; `baselines`: the same of bodies that do not dance.
        rows: One row a rollout, of the policy and of every baseline.
        rollout: What the robot did from the first step of the motion on.
    """

    summary: dict[str, Any]
    rows: list[dict[str, Any]]
    rollout: Rollout

    def __repr__(self) -> str:
        figures = self.summary
        if figures["verdict"]["kind"] == "too_short":
            said = "too short to evaluate"
        else:
            said = f"strict_success={figures['strict_success']:.0%}, skill={figures['skill']:.2f}"
        return (
            f"PolicyEvaluation({said}, site_error_m={figures['site_error_m']:.3f}, "
            f"survived_s={figures['survived_s']:.2f}, {figures['rollouts']:.0f} rollouts)"
        )

    def save(self, folder: FilePath) -> Path:
        """Write evaluations.parquet, evaluation.json and rollout.parquet.

        Returns:
            The folder.

        Raises:
            StoreError: it cannot be written.
        """
        rows = tables.encode_rows(EVALUATION_RECORD, self.rows)
        summary = to_json(self.summary)
        with results_in(Path(folder)) as files:
            files.write("evaluations.parquet", rows)
            files.write("evaluation.json", summary)
            files.write("rollout.parquet", self.rollout.to_bytes())
        return Path(folder)


def evaluate_policy(
    policy: FilePath | Policy | TrainedPolicy | Tracker,
    reference: FilePath | ReferenceMotion,
    robot: RobotLike | None = None,
    *,
    config: EvaluateConfig | None = None,
    move: str = "",
    setup: str = "",
    progress: bool | PartProgress = False,
) -> PolicyEvaluation:
    """Evaluate a policy on stock physics from many starts, beside baselines that do not dance.

    Args:
        policy: A training or its policy, or policy.safetensors; or a tracker (`load_tracker`).
        reference: The motion that it was trained on, or its file; any motion for a tracker.
        robot: The one that the motion was made for; None finds it by name.
        config: Starts, horizon and noise.
        move: Name of the dance in the tables.
        setup: Name of the training in the tables, where the policy's file does not give it.
        progress: True shows a bar; a function is called with (name of the part, done, in all).

    Returns:
        Survival in seconds, strict success 0..1, skill (1 is perfect, 0 the best frozen pose), mean
        site error in metres, and one row a rollout.

    Raises:
        BadPolicy: no policy file of ours, or a policy or tracker for another robot.
        RejectedReference: the robot's model has changed since the motion was made.
    """
    motion = read_if_path(ReferenceMotion, reference)
    machine = robot_of(motion) if robot is None else require_robot(motion, load_robot(robot))
    trained = _policy_of(policy)
    if not isinstance(trained, Policy):
        require_for(trained.description, machine.description.name)
    with counter(progress is True, "evaluation") as count:
        notify: PartProgress = (lambda name, done, total: None) if progress is False else progress  # type: ignore[assignment]
        if count is not None:
            notify = lambda name, done, total: count(done, total)  # noqa: E731
        evaluated = policy_evaluation.evaluate_policy(
            trained, motion, machine, config or EvaluateConfig(), notify
        )
    name = move or ("motion" if isinstance(reference, ReferenceMotion) else motion_name(reference))
    if isinstance(trained, Policy):
        learnt, said = trained.training, trained.setup or setup or "scratch"
    else:
        learnt, said = {"seed": 0, "step": None}, trained.description.name
    labels = run_labels(name, said, learnt["seed"])
    rows = [{**labels, **learnt, **row} for row in evaluated.rows]
    return PolicyEvaluation(
        dict(evaluated.summary), rows, Rollout(motion.dt, evaluated.rollout_qpos)
    )


def _policy_of(given: FilePath | Policy | TrainedPolicy | Tracker) -> Policy | Tracker:
    if isinstance(given, TrainedPolicy):
        return given.policy
    if isinstance(given, str | PathLike):
        return load_policy(Path(given))
    if not isinstance(given, Policy) and not hasattr(given, "equip"):
        raise TypeError(f"policy is {given!r:.100}: expected a policy, its file or a tracker")
    return given


def render_video(
    out: FilePath,
    reference: FilePath | ReferenceMotion,
    *,
    rollout: FilePath | PolicyEvaluation | Rollout | Float[np.ndarray, "S nq"] | None = None,
    motion: FilePath | SmplSequence | None = None,
    video: FilePath | None = None,
    landmarks: FilePath | LandmarkTrack | None = None,
    robot: RobotLike | None = None,
    config: VideoConfig | None = None,
    plain: bool = False,
    title: str = TRAINED_TITLE,
    progress: Progress = False,
) -> VideoInfo:
    """Write an mp4 of the reference robot beside the other given motions, at the same moment.

    Args:
        out: The file.
        reference: The robot's motion.
        rollout: The trained robot: an evaluation, its rollout or the file of that, or qpos (S, nq)
            a control step.
        motion: The person, as a skeleton.
        video: The source; with `landmarks`.
        landmarks: What was detected in it.
        robot: The one that the motion was made for; None finds it by name.
        config: Size, rate, length and camera.
        plain: Show the source without marks, too, and `motion` over it instead of the landmarks.
        title: Over the panel of the rollout.
        progress: True shows a bar; a function is called with (pictures done, pictures in all).

    Returns:
        What the file holds.

    Raises:
        MissingDependency: no way to draw without a screen; the message is what to install.
        BadConfiguration: a video without landmarks, or the other way round.
        StoreError: the file cannot be written.
    """
    if (video is None) != (landmarks is None):
        raise BadConfiguration("a video is shown with its landmarks: give both or neither")
    target = read_if_path(ReferenceMotion, reference)
    machine = robot_of(target) if robot is None else require_robot(target, load_robot(robot))
    danced = rollout.rollout if isinstance(rollout, PolicyEvaluation) else rollout
    danced = read_if_path(Rollout, danced) if isinstance(danced, str | PathLike) else danced
    qpos = danced.qpos if isinstance(danced, Rollout) else danced
    if qpos is not None and np.shape(qpos)[1:] != (machine.model.nq,):
        needed = f"{machine.description.name} needs (steps, {machine.model.nq})"
        raise BadConfiguration(f"the rollout has states of shape {np.shape(qpos)}; {needed}")
    track = None if landmarks is None else read_if_path(LandmarkTrack, landmarks)
    person = None if motion is None else read_if_path(SmplSequence, motion)
    source = None if video is None else Path(video)
    path = Path(out)
    with results_in(path.parent), counter(progress, path.name) as count:
        side_by_side(
            source, track, person, target, qpos, path,
            model=machine.model, config=config, progress=count, plain=plain,
            title=title,
        )  # fmt: skip
    return video_files.probe(path, video_files.VideoLimits(max_duration_s=None, min_frames=1))
