"""Training as an operating-system process of its own, which never imports Prefect.

It dies with the task: by SIGTERM and then SIGKILL to its process group when the task is cancelled,
by the kernel when this process is killed. Its folder stays until it has succeeded, so that the same
call goes on from the last checkpoint.
"""

import asyncio
import hashlib
import json
import os
import shutil
import signal
import sys
import time
from asyncio.subprocess import PIPE, Process
from collections import deque
from collections.abc import AsyncIterator
from dataclasses import asdict, dataclass
from pathlib import Path

import yaml
from prefect.logging import get_run_logger

from robojackson.errors import TrainingFailed
from robojackson.retarget.robot import RobotDescription
from robojackson.rl.config import TrainConfig
from storage.artifact import Artifact
from storage.lock import locked
from storage.store import Store
from tasks.caching import identity, stage

SECONDS_TO_SAVE = 30.0
"""What a training gets to write its checkpoint before it is killed."""
OVERTIME_S = 300.0
"""What a training may take beyond its budget: start, compilation, last checkpoint."""
CHECKOUT = Path(__file__).parent.parent


@dataclass(frozen=True)
class RunLabels:
    """What the rows of a run are known by.

    Attributes:
        move: Name of the dance.
        setup: Name of the training setup.
    """

    move: str
    setup: str


@stage(reaches=("robojackson.rl.train",), unkeyed=("labels", "deadline"))
async def train(
    reference: Artifact,
    robot: RobotDescription,
    config: TrainConfig,
    labels: RunLabels,
    deadline: float | None = None,
) -> dict[str, Artifact]:
    """`policy`: safetensors; `episodes`: EpisodeRecord; `training`: steps, seconds, as JSON.

    Args:
        deadline: Unix time at which the budget ends in any case, seconds.
    Raises:
        StoreError: the same training is running already.
    """
    store = Store.from_environment()
    facts = json.dumps(identity([reference, robot, config]), sort_keys=True)
    digest = hashlib.sha256(facts.encode()).hexdigest()[:12]
    run_id = f"{labels.move}-{labels.setup}-s{config.seed}-{digest}"
    work = store.work(f"train-{digest}")
    minutes = _minutes(config, deadline)
    with locked(work, "task.lock"), store.local(reference) as path:
        command = _command(path, work, config, labels, run_id, minutes)
        answer = await run_process(command, run_id, work, minutes)
        kept = {
            "training": store.keep("train", "training.json", _facts(answer, labels)),
            "policy": store.keep("train", "policy.safetensors", work / "policy.safetensors"),
            "episodes": store.keep("train", "episodes.parquet", work / "episodes.parquet"),
        }
        shutil.rmtree(work, ignore_errors=True)
    return kept


def _minutes(config: TrainConfig, deadline: float | None) -> float | None:
    if config.minutes is None or deadline is None:
        return config.minutes
    return max(0.5, min(config.minutes, (deadline - time.time()) / 60))


def _command(
    reference: Path,
    work: Path,
    config: TrainConfig,
    labels: RunLabels,
    run_id: str,
    minutes: float | None,
) -> list[str]:
    setup = work / f"{labels.setup}.yaml"
    setup.write_text(yaml.safe_dump(json.loads(json.dumps(asdict(config)))))
    options = {
        "--out": work,
        "--setup": setup,
        "--run-id": run_id,
        "--move": labels.move,
        "--parent": os.getpid(),
    }
    if minutes is not None:
        options["--minutes"] = f"{minutes:.3f}"
    words = [str(word) for pair in options.items() for word in pair]
    return [sys.executable, "-m", "flows.cli", "train", str(reference), *words, "--json"]


async def run_process(command: list[str], run_id: str, work: Path, minutes: float | None) -> bytes:
    """Run the process to its end, its words in our log; no way out leaves it alive.

    Returns:
        What it wrote to stdout.
    Raises:
        TrainingFailed: it died, or did not end.
    """
    process = await asyncio.create_subprocess_exec(
        *command, stdout=PIPE, stderr=PIPE, start_new_session=True, env=environment()
    )
    limit = None if minutes is None else 60 * minutes + OVERTIME_S
    last: deque[str] = deque(maxlen=5)
    try:
        async with asyncio.timeout(limit):
            forward = _forward(process, work / "train.log", last)
            answer, _ = await asyncio.gather(_read(process), forward)
            await process.wait()
    except TimeoutError:
        raise TrainingFailed(f"run {run_id} did not end within {limit:.0f} s") from None
    finally:
        await _end(process)
    if process.returncode:
        raise TrainingFailed(_cause(run_id, process.returncode, work, last))
    return answer


def environment() -> dict[str, str]:
    """Ours, with one OpenMP thread and this checkout importable."""
    found = os.environ.get("PYTHONPATH")
    path = os.pathsep.join([str(CHECKOUT), *([found] if found else [])])
    return {**os.environ, "OMP_NUM_THREADS": "1", "PYTHONPATH": path, "PYTHONUNBUFFERED": "1"}


async def _forward(process: Process, log_file: Path, last: deque[str]) -> None:
    logger = get_run_logger()
    with log_file.open("a") as file:
        async for line in _lines(process):
            file.write(f"{line}\n")
            file.flush()
            last.append(line)
            logger.info(line)


async def _lines(process: Process) -> AsyncIterator[str]:
    assert process.stderr is not None
    async for raw in process.stderr:
        line = raw.decode(errors="replace").rstrip()
        if line:
            yield line


async def _read(process: Process) -> bytes:
    assert process.stdout is not None
    return await process.stdout.read()


async def _end(process: Process) -> None:
    """Leave nothing of the process group: ask, wait, kill."""
    if process.returncode is not None:
        return
    os.killpg(process.pid, signal.SIGTERM)
    try:
        async with asyncio.timeout(SECONDS_TO_SAVE):
            await process.wait()
    except TimeoutError:
        os.killpg(process.pid, signal.SIGKILL)
        await process.wait()


def _facts(answer: bytes, labels: RunLabels) -> bytes:
    """What is told of a training, without the paths of this machine."""
    said = json.loads(answer)
    told = ("trainer", "seed", "steps", "updates", "stopped", "episodes")
    facts = {key: said[key] for key in told} | {"training_s": said["seconds"]}
    return json.dumps({"setup": labels.setup, **facts}, indent=1).encode()


def _cause(run_id: str, code: int, work: Path, last: deque[str]) -> str:
    """Which run died, why, where its log is."""
    if code < 0:
        how = f"was killed by {signal.Signals(-code).name}"
        if -code == signal.SIGKILL:
            how += " (by hand, or out of memory)"
    else:
        how = f"ended with exit code {code}: {last[-1] if last else 'it said nothing'}"
    return f"run {run_id} {how}; log: {work / 'train.log'}; the same command resumes it"
