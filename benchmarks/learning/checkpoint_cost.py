"""Cost of a training's checkpoints: the default method on the hip-shake, one core."""

import os
import tempfile
import time
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np

from benchmarks.learning.environment_core import humanoid
from benchmarks.learning.policies import Folders, reference_of
from benchmarks.learning.speed import comparison
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.rl.config.train_config import TrainConfig
from robojackson.rl.training import train_policy
from robojackson.rl.training_run import Run

BAR = "<= 0.02"


def checkpoints(folders: Folders, minutes: float = 5.0) -> dict[str, Any]:
    """Return wall seconds of a checkpoint (median) over those between two of them, as they are by
    default.

    `slowest_s` is the longest, `megabytes` what one adds to the replay on the disk, `steps` those
    between two.
    """
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    spent: list[float] = []
    sizes: list[int] = []
    steps: list[int] = [0]
    written = Run.checkpoint

    def timed(run: Run) -> None:
        began = time.perf_counter()
        written(run)
        spent.append(time.perf_counter() - began)
        sizes.append(max((run.out / "replay").glob("*.npz")).stat().st_size)
        steps.append(run.trainer.steps())

    motion = ReferenceMotion.load(reference_of("hip_shake", folders))
    config, timing = TrainConfig(minutes=minutes), patch.object(Run, "checkpoint", timed)
    with tempfile.TemporaryDirectory(dir=folders.work) as out, timing:
        train_policy(motion, humanoid(), config, Path(out))
    # The last one ends the training, whenever that is.
    middle, between = float(np.median(spent[:-1])), config.checkpoint_seconds
    return {
        **comparison(
            "a checkpoint, s, over those between two", middle, between, middle / between, BAR
        ),
        "slowest_s": max(spent[:-1]),
        "megabytes": float(np.median(sizes[:-1])) / 1e6,
        "steps": int(np.median(np.diff(steps[:-1]))),
        "load_average": os.getloadavg()[0],
    }
