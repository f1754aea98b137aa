"""The verdict on a policy in a process of its own, so that cells wait without holding a core."""

import hashlib
import json
import os
import shutil
import sys

import yaml

from robojackson.files.json_types import to_json_types
from robojackson.pipeline.folder_lock import A_MOMENT, locked
from robojackson.rl.config.train_config import EvaluateConfig
from robojackson.robot.model import RobotDescription
from storage.artifact import Artifact
from storage.store import Store
from tasks.runtime.child_process import run_process
from tasks.runtime.robot_digests import robot_file, robot_models
from tasks.runtime.stage import identity, stage

TABLE, SUMMARY, ROLLOUT = "evaluations.parquet", "evaluation.json", "rollout.parquet"


@stage(
    models=robot_models,
    reaches=("robojackson.api.evaluation",),
    unkeyed=("limit_s",),
)
async def evaluate_policy(
    policy: Artifact,
    reference: Artifact,
    robot: RobotDescription,
    config: EvaluateConfig,
    limit_s: float | None = None,
) -> dict[str, Artifact]:
    """Return `evaluations` (EvaluationRecord), `evaluation` (means, JSON) and `rollout` (Rollout).

    Args:
        limit_s: Time after which it has failed, seconds.
    """
    store = Store.from_environment()
    digest = hashlib.sha256(json.dumps(identity([policy, reference, robot, config])).encode())
    name = f"evaluate-{digest.hexdigest()[:12]}"
    work = store.work(name)
    with (
        locked(work, "task.lock", A_MOMENT, "the same evaluation"),
        store.local(policy) as learnt,
        store.local(reference) as motion,
    ):
        settings = work / "evaluate.yaml"
        settings.write_text(yaml.safe_dump({"evaluate": to_json_types(config)}))
        words = ["evaluate", learnt, motion, "--out", work, "--config", settings]
        words += ["--robot", robot_file(robot, work), "--parent", os.getpid(), "--json"]
        command = [sys.executable, "-m", "robojackson.cli", *map(str, words)]
        await run_process(command, name, work, limit_s)
        kept = {
            "evaluations": store.save("evaluate", TABLE, work / TABLE),
            "evaluation": store.save("evaluate", SUMMARY, work / SUMMARY),
            "rollout": store.save("evaluate", ROLLOUT, work / ROLLOUT),
        }
        shutil.rmtree(work, ignore_errors=True)
    return kept
