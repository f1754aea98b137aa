"""Flow `pretrain`: train a walker in a process of its own; the deployment is `pretrain/walker`."""

import hashlib
import json
import os
import shutil
import sys
from typing import Annotated, Any, Literal

from prefect import flow
from pydantic import Field

from robojackson.cli.learning.walker_training import PIPELINE, ROBOT
from robojackson.pipeline.folder_lock import A_MOMENT, locked
from robojackson.pipeline.pipeline_config import PipelineConfig
from robojackson.pipeline.robot_descriptions import describe_robot
from robojackson.pipeline.yaml_loader import load
from robojackson.rl.config.train_config import TrainConfig
from robojackson.rl.walkers import is_shipped, walker_key
from robojackson.robot.description import RobotDescription
from storage.store import Store
from tasks.runtime.child_process import run_process
from tasks.runtime.stage import identity

DIGITS = 12
"""Of the digest in the name of a folder of work."""


@flow(name="pretrain", flow_run_name="walker-{kind}-{robot}-s{seed}")
async def pretrain(
    kind: Literal["track", "paper"] = "track",
    steps: Annotated[int, Field(ge=1)] = 400_000,
    seed: Annotated[int, Field(ge=0)] = 0,
    robot: str = ROBOT,
) -> str:
    """Train a walker of a kind; the same call resumes from the last checkpoint.

    Args:
        kind: The mode whose trainings start from it.
        steps: Control steps in all.
        seed: Seed of the training.
        robot: Name of `configs/robots/*.yaml`, or path, where the worker is, of your own YAML; for
            `paper` only Humanoid-v5. A walker of a robot for which none ships is what trainings of
            that robot start from with `start: walker`.
    Returns:
        The key of its networks in the store.
    Raises:
        StoreError: the same walker is being trained already.
        UnknownName, BadConfiguration: no such robot, or its model is not here.
    """
    store = Store.from_environment()
    description = describe_robot(robot)
    shipped = is_shipped(description, kind)
    name = name_of(kind, steps, seed, description)
    work = store.work(name)
    command = [
        sys.executable,
        "-m",
        "robojackson.cli",
        "pretrain",
        "--kind",
        kind,
        "-o",
        str(work),
    ]
    options: dict[str, Any] = {"--steps": steps, "--seed": seed, "--parent": os.getpid()}
    if robot != ROBOT:
        options["--robot"] = description.file or robot
    words = [str(word) for pair in options.items() for word in pair]
    with locked(work, "task.lock", A_MOMENT):
        await run_process([*command, *words, "--json"], name, work)
        made = f"walker_{kind}.safetensors"
        store.save("pretrain", "walker.json", work / "walker.json")
        key = store.save("pretrain", made, work / made).key
        if not shipped:
            key = store.put(walker_key(description, kind), work / made).key
        shutil.rmtree(work, ignore_errors=True)
    return key


def name_of(kind: str, steps: int, seed: int, robot: RobotDescription) -> str:
    """Return the name of a walker's folder of work: all that makes its training what it is."""
    config = load(TrainConfig, f"setups/walker-{kind}", {"steps": steps, "seed": seed})
    facts = json.dumps(identity([config, robot, load(PipelineConfig, PIPELINE)]), sort_keys=True)
    digest = hashlib.sha256(facts.encode()).hexdigest()[:DIGITS]
    return f"walker-{kind}-{steps}-s{seed}-{digest}"
