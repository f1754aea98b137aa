"""Flow `pretrain`: train a walker in a process of its own; the deployment is `pretrain/walker`."""

import hashlib
import json
import os
import shutil
import sys
from typing import Any, Literal

from prefect import flow

from robojackson.cli.walker_training import PIPELINE, ROBOT
from robojackson.pipeline.folder_lock import A_MOMENT, locked
from robojackson.pipeline.pipeline_config import PipelineConfig
from robojackson.pipeline.robot_descriptions import describe_robot
from robojackson.pipeline.yaml_loader import load
from robojackson.rl.config.train_config import TrainConfig
from storage.store import Store
from tasks.runtime.child_process import run_process
from tasks.runtime.stage import identity

DIGITS = 12
"""Of the digest in the name of a folder of work."""


@flow(name="pretrain", flow_run_name="walker-{kind}-s{seed}")
async def pretrain(
    kind: Literal["track", "paper"] = "track", steps: int = 400_000, seed: int = 0
) -> str:
    """A walker of a kind; the same call goes on from the last checkpoint.

    Returns:
        The key of its networks in the store.
    Raises:
        StoreError: the same walker is being trained already.
    """
    store = Store.from_environment()
    name = name_of(kind, steps, seed)
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
    words = [str(word) for pair in options.items() for word in pair]
    with locked(work, "task.lock", A_MOMENT):
        await run_process([*command, *words, "--json"], name, work)
        made = f"walker_{kind}.safetensors"
        store.save("pretrain", "walker.json", work / "walker.json")
        key = store.save("pretrain", made, work / made).key
        shutil.rmtree(work, ignore_errors=True)
    return key


def name_of(kind: str, steps: int, seed: int) -> str:
    """What a walker's folder of work is called: all that makes its training what it is."""
    config = load(TrainConfig, f"setups/walker-{kind}", {"steps": steps, "seed": seed})
    robot = describe_robot(ROBOT)
    facts = json.dumps(identity([config, robot, load(PipelineConfig, PIPELINE)]), sort_keys=True)
    digest = hashlib.sha256(facts.encode()).hexdigest()[:DIGITS]
    return f"walker-{kind}-{steps}-s{seed}-{digest}"
