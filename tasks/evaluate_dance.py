"""The verdict on a policy, or on a tracker that was not trained on this dance."""

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

from robojackson.files import tables
from robojackson.files.json_types import to_json
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.motion.rollout import Rollout
from robojackson.pipeline.table_schemas import EVALUATION_RECORD
from robojackson.rl.config.train_config import EvaluateConfig
from robojackson.rl.trackers.tracker_description import TrackerDescription
from robojackson.robot.model import RobotDescription, load_robot
from storage import artifact_tables
from storage.artifact import Artifact
from storage.store import Store
from tasks.runtime.robot_digests import robot_models
from tasks.runtime.stage import stage
from tasks.train_policy import RunLabels

if TYPE_CHECKING:
    from robojackson.rl.evaluation.policy_evaluation import Evaluation

Row = Mapping[str, object]
FEW_PHASES = 8
"""Start phases of a first look; with the stand nine starts."""


@stage(models=robot_models, unkeyed=("labels",))
def evaluate_dance(
    policy: Artifact,
    reference: Artifact,
    robot: RobotDescription,
    config: EvaluateConfig,
    labels: RunLabels,
) -> dict[str, Artifact]:
    """Return `evaluations` (EvaluationRecord), `evaluation` (means, JSON) and `rollout`
    (Rollout)."""
    from robojackson.rl.evaluation.policy_evaluation import evaluate_policy
    from robojackson.rl.policy import load_policy

    store = Store.from_environment()
    motion = artifact_tables.read(ReferenceMotion, store, reference)
    with store.local(policy) as path:
        trained = load_policy(path)
    verdict = evaluate_policy(trained, motion, load_robot(robot), config)
    run_id = f"{labels.move}-{labels.setup}-s{trained.training['seed']}"
    common = {"run_id": run_id, "move": labels.move, "setup": labels.setup, **trained.training}
    return _saved(store, "evaluate", "", verdict, motion.dt, common)


@stage(models=robot_models, unkeyed=("labels",))
def evaluate_tracker(
    tracker: TrackerDescription,
    reference: Artifact,
    robot: RobotDescription,
    config: EvaluateConfig,
    labels: RunLabels,
) -> dict[str, Artifact]:
    """Return `evaluations` (EvaluationRecord), `evaluation` (means, JSON) and `rollout` (Rollout).

    Raises:
        BadPolicy: the tracker's file is not here, or it is for another robot.
    """
    from robojackson.rl.evaluation.policy_evaluation import evaluate_policy
    from robojackson.rl.trackers.tracker_file import open_tracker

    store = Store.from_environment()
    motion = artifact_tables.read(ReferenceMotion, store, reference)
    verdict = evaluate_policy(open_tracker(tracker), motion, load_robot(robot), config)
    names = {"run_id": f"{labels.move}-{tracker.name}", "move": labels.move}
    common = {**names, "setup": tracker.name, "seed": 0, "step": None}
    return _saved(store, "track", "tracker_", verdict, motion.dt, common)


def _saved(
    store: Store, stage_name: str, prefix: str, verdict: "Evaluation", dt: float, common: Row
) -> dict[str, Artifact]:
    """Return the artifacts of an evaluation; `common` are the columns that all its rows share."""
    rows = tables.encode_rows(EVALUATION_RECORD, [{**common, **row} for row in verdict.rows])
    summary = to_json(verdict.summary)
    rollout, name = Rollout(dt, verdict.rollout_qpos), f"{prefix}rollout.parquet"
    return {
        "evaluations": store.save(stage_name, f"{prefix}evaluations.parquet", rows),
        "evaluation": store.save(stage_name, f"{prefix}evaluation.json", summary),
        "rollout": artifact_tables.save(store, stage_name, name, rollout),
    }


def first_look(config: EvaluateConfig) -> EvaluateConfig:
    """Return the same evaluation from a few starts."""
    return replace(config, phases=min(FEW_PHASES, config.phases), resets=1, passport=False)
