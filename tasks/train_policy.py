"""Training as an operating-system process of its own, which never imports Prefect.

Its folder stays until it has succeeded, so that the same call goes on from the last checkpoint.
"""

import hashlib
import json
import math
import os
import shutil
import sys
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from robojackson.files.json_types import to_json_types
from robojackson.files.local_folder import sha256_of_file
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.pipeline.folder_lock import A_MOMENT, locked
from robojackson.rl.config.train_config import TrainConfig
from robojackson.rl.modes.track_mode import is_fed
from robojackson.rl.tensorboard_log import LOGS
from robojackson.robot.model import RobotDescription
from storage.artifact import Artifact
from storage.store import Store
from tasks.runtime.child_process import run_process
from tasks.runtime.code_digest import digest
from tasks.runtime.robot_digests import robot_file
from tasks.runtime.run_logger import run_logger
from tasks.runtime.stage import identity, stage
from tasks.runtime.start_networks import local_start_file
from tasks.runtime.training_progress import show_progress

CODE = ("robojackson.api.policy_training",)
"""Module of what the process runs."""
SHORTEST_MINUTES = 0.5
"""What a training gets in any case."""
BUDGET = "training gets %.1f min, the pass %g; dances of this length need about %.0f"
"""Log line about the budget, which the bar of `robojackson dance` shows as well."""
DIGITS = 12
"""Of the digest in a run id."""
OVERTIME_S, SEARCH_S_A_SECOND = 300.0, 60.0
"""What a training may take beyond its budget: start, compilation, last checkpoint; and, on a robot
with feedback, for its search along each second of the motion (docs/learning_g1.md)."""


@dataclass(frozen=True)
class RunLabels:
    """Labels of the rows of a run.

    Attributes:
        move: Name of the dance.
        setup: Name of the training setup.
    """

    move: str
    setup: str


@dataclass(frozen=True)
class TrainingTime:
    """Time that a pass leaves for its training.

    Attributes:
        deadline: Unix time at which the training ends in any case, seconds.
        needed_minutes: About what such a dance takes.
    """

    deadline: float
    needed_minutes: float


def _models(parameters: Mapping[str, Any]) -> list[str]:
    """Return the digest of the networks to start from. The key holds the requested minutes, not
    those that the clock left: the same call does not train again.
    """
    return _start(parameters["config"], parameters["robot"])


@stage(models=_models, reaches=CODE, unkeyed=("labels", "time_left", "limit_s"))
async def train_policy(
    reference: Artifact,
    robot: RobotDescription,
    config: TrainConfig,
    labels: RunLabels,
    time_left: TrainingTime | None = None,
    limit_s: float | None = None,
    whole_pass: bool = False,
) -> dict[str, Artifact]:
    """Return `policy` (safetensors), `episodes` (EpisodeRecord) and `training` (steps, seconds,
    JSON).

    Args:
        time_left: Time that the pass leaves for it.
        whole_pass: Whether `config.minutes` is the budget of a whole pass, of which training gets
            what the other stages leave.
        limit_s: Time after which it has failed, seconds; a budget in minutes sets one by itself.
    Raises:
        StoreError: the same training is running already.
    """
    store = Store.from_environment()
    run_id = run_id_of(reference, robot, config, labels)
    work = store.work(f"train-{run_id[-DIGITS:]}")
    with locked(work, "task.lock", A_MOMENT), store.local(reference) as path:
        minutes = _minutes(config, time_left, whole_pass)
        if minutes is not None:
            limit_s = min(limit_s or math.inf, 60 * minutes + _overtime_s(path, robot, config))
        command = _command(path, work, robot, config, labels, run_id, minutes)
        async with show_progress(work, f"{labels.setup}-{labels.move}-s{config.seed}"):
            answer = await run_process(command, run_id, work, limit_s)
        kept = {
            "training": store.save("train", "training.json", _facts(answer, labels)),
            "policy": store.save("train", "policy.safetensors", work / "policy.safetensors"),
            "episodes": store.save("train", "episodes.parquet", work / "episodes.parquet"),
        }
        for log in sorted((work / LOGS).glob("*")):  # beside what is cached
            store.put(f"{LOGS}/{run_id}/{log.name}", log)
        shutil.rmtree(work, ignore_errors=True)
    return kept


def run_id_of(
    reference: Artifact, robot: RobotDescription, config: TrainConfig, labels: RunLabels
) -> str:
    """Return the names and a digest of everything that determines the training, its code included;
    no clock, no machine.
    """
    parts = [identity([reference, robot, config]), _start(config, robot), digest(CODE)]
    facts = json.dumps(parts, sort_keys=True)
    short = hashlib.sha256(facts.encode()).hexdigest()[:DIGITS]
    return f"{labels.move}-{labels.setup}-s{config.seed}-{short}"


def _start(config: TrainConfig, robot: RobotDescription) -> list[str]:
    """Return the digest of the networks that it starts from, if it does."""
    path = local_start_file(Store.from_environment(), config, robot)
    return [] if path is None else [sha256_of_file(path)]


def _overtime_s(reference: Path, robot: RobotDescription, config: TrainConfig) -> float:
    """Return what a training may take beyond its budget before it counts as hung, seconds."""
    if not is_fed(config, robot):
        return OVERTIME_S
    motion = ReferenceMotion.load(reference)
    return OVERTIME_S + SEARCH_S_A_SECOND * len(motion) * motion.dt


def _minutes(config: TrainConfig, time_left: TrainingTime | None, whole_pass: bool) -> float | None:
    """Return what remains of the requested minutes; log it."""
    if config.minutes is None or time_left is None:
        return config.minutes
    left = max(SHORTEST_MINUTES, (time_left.deadline - time.time()) / 60)
    granted = left if whole_pass else min(config.minutes, left)
    run_logger().info(BUDGET, granted, config.minutes, time_left.needed_minutes)
    return granted


def _command(
    reference: Path,
    work: Path,
    robot: RobotDescription,
    config: TrainConfig,
    labels: RunLabels,
    run_id: str,
    minutes: float | None,
) -> list[str]:
    setup = work / "setup" / f"{labels.setup}.yaml"  # a setup may have any name
    setup.parent.mkdir(exist_ok=True)
    setup.write_text(yaml.safe_dump(to_json_types(config)))
    options = {
        "--out": work,
        "--setup": setup,
        "--robot": robot_file(robot, work),
        "--run-id": run_id,
        "--move": labels.move,
        "--parent": os.getpid(),
    }
    if minutes is not None:
        options["--minutes"] = f"{minutes:.3f}"
    words = [str(word) for pair in options.items() for word in pair]
    return [
        sys.executable,
        "-m",
        "robojackson.cli",
        "train",
        str(reference),
        *words,
        "--force",
        "--json",
    ]


def _facts(answer: bytes, labels: RunLabels) -> bytes:
    """Return the facts of a training, without the paths of this machine."""
    said = json.loads(answer)
    public_keys = ("trainer", "seed", "steps", "updates", "stopped", "episodes")
    facts = {key: said[key] for key in public_keys} | {"training_s": said["seconds"]}
    return json.dumps({"setup": labels.setup, **facts}, indent=1).encode()
