"""A training that is killed again and again ends as one that was not."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from robojackson.files import tables
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.pipeline.table_schemas import EPISODE_RECORD
from tests.fixtures.commands import environment

KILLS = 2
STEPS = {"sbx": 24_000, "sb3": 4_800}
"""A few seconds of training on one core."""
OPTIONS = (
    *("--force", "--seed=3", "--set=checkpoint_seconds=0.2", "--set=progress_seconds=0.05"),
    *("--set=tqc.n_envs=4", "--set=tqc.warmup=100", "--set=tqc.batch=32", "--set=track.threads=1"),
    *("--set=tqc.updates_per_round=2", "--set=tqc.actor=[16,16]", "--set=tqc.critic=[16,16]"),
)


def training(reference: Path, out: Path, trainer: str) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "robojackson", "train", reference, "-o", out, *OPTIONS]
    command += [f"--trainer={trainer}", f"--steps={STEPS[trainer]}"]
    words = [str(word) for word in command]
    return subprocess.Popen(
        words, env=environment(), stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
    )


def ended(process: subprocess.Popen[str]) -> None:
    _, found = process.communicate(timeout=240)
    assert process.returncode == 0, found


def killed(reference: Path, out: Path, trainer: str, rng: np.random.Generator) -> bool:
    """Start or go on, and kill it a while after it is under way; whether it still was."""
    before = (out / "progress.json").stat().st_mtime if (out / "progress.json").exists() else 0.0
    process = training(reference, out, trainer)
    while process.poll() is None:
        result = out / "progress.json"
        if result.exists() and result.stat().st_mtime > before:
            break
        time.sleep(0.02)
    time.sleep(rng.uniform(0.0, 1.5))
    os.kill(process.pid, signal.SIGKILL)
    process.communicate()
    return process.returncode == -signal.SIGKILL


@pytest.mark.slow
@pytest.mark.parametrize("trainer", [pytest.param("sbx", marks=pytest.mark.heavy), "sb3"])
def test_a_training_killed_at_random_moments_ends_as_one_that_was_not(
    sway: ReferenceMotion, tmp_path: Path, trainer: str
) -> None:
    """The policy to the byte, and every row of the table of episodes."""
    reference = tmp_path / "reference.parquet"
    reference.write_bytes(tables.encode(sway))
    whole, torn = tmp_path / "whole", tmp_path / "torn"
    ended(training(reference, whole, trainer))
    rng = np.random.default_rng()
    assert sum(killed(reference, torn, trainer, rng) for _ in range(KILLS)) > 0
    ended(training(reference, torn, trainer))
    assert (torn / "policy.safetensors").read_bytes() == (whole / "policy.safetensors").read_bytes()
    tables_of = [
        tables.decode_rows(EPISODE_RECORD, (out / "episodes.parquet").read_bytes(), str(out))
        for out in (whole, torn)
    ]
    assert tables_of[1] == tables_of[0]
    assert len(tables_of[0]) > 10
