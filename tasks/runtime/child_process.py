"""Heavy work as an operating-system process of its own, which never imports Prefect.

It dies with the task: by SIGTERM and then SIGKILL to its process group when the task is cancelled,
by the kernel when this process is killed.
"""

import asyncio
import os
import signal
from asyncio.subprocess import PIPE, Process
from collections import deque
from collections.abc import AsyncIterator, Callable
from contextlib import suppress
from pathlib import Path

from robojackson.errors import TrainingCrashed, TrainingFailed
from robojackson.rl.training_hooks import SECONDS_TO_SAVE
from tasks.runtime.run_logger import run_logger

CHECKOUT = Path(__file__).parents[2]
LOG = "process.log"


async def run_process(
    command: list[str], run_id: str, work: Path, limit_s: float | None = None
) -> bytes:
    """Run the process to its end, its words in our log; no way out leaves it alive.

    Args:
        run_id: What it is called when it fails.
        work: Folder for its log.
        limit_s: Time after which it has failed, seconds.
    Returns:
        What it wrote to stdout.
    Raises:
        TrainingCrashed: it was killed; the same again may succeed.
        TrainingFailed: it gave up, or did not end.
    """
    process = await asyncio.create_subprocess_exec(
        *command, stdout=PIPE, stderr=PIPE, start_new_session=True, env=environment()
    )
    last: deque[str] = deque(maxlen=5)
    try:
        async with asyncio.timeout(limit_s):
            forward = _forward(process, work / LOG, last)
            answer, _ = await asyncio.gather(_read(process), forward)
            await process.wait()
    except TimeoutError:
        raise TrainingFailed(f"run {run_id} did not end within {limit_s:.0f} s") from None
    finally:
        await _end(process)
    if process.returncode:
        raise _cause(run_id, process.returncode, work, last)
    return answer


def environment() -> dict[str, str]:
    """Ours, with one OpenMP thread and this checkout importable."""
    found = os.environ.get("PYTHONPATH")
    path = os.pathsep.join([str(CHECKOUT), *([found] if found else [])])
    return {**os.environ, "OMP_NUM_THREADS": "1", "PYTHONPATH": path, "PYTHONUNBUFFERED": "1"}


async def _forward(process: Process, log_file: Path, last: deque[str]) -> None:
    say: Callable[[str], None] = run_logger().info
    with log_file.open("a") as file:
        async for line in _lines(process):
            file.write(f"{line}\n")
            file.flush()
            last.append(line)
            say(line)


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
    """Leave nothing of the process group: ask, wait, kill; at once where the waiting, too, is cut
    short."""
    if process.returncode is not None:
        return
    _signal(process, signal.SIGTERM)
    try:
        async with asyncio.timeout(SECONDS_TO_SAVE):
            await process.wait()
    except TimeoutError:
        await _kill(process)
    except asyncio.CancelledError:
        await _kill(process)
        raise


async def _kill(process: Process) -> None:
    _signal(process, signal.SIGKILL)
    await process.wait()


def _signal(process: Process, what: signal.Signals) -> None:
    with suppress(ProcessLookupError):  # it may have ended a moment ago
        os.killpg(process.pid, what)


def _cause(run_id: str, code: int, work: Path, last: deque[str]) -> TrainingFailed:
    """Which run died, why, where its log is."""
    told = f"log: {work / LOG}"
    if code < 0:
        how = f"was killed by {signal.Signals(-code).name}"
        if -code == signal.SIGKILL:
            how += " (by hand, or out of memory)"
        return TrainingCrashed(f"run {run_id} {how}; {told}; the same command resumes it")
    said = last[-1] if last else "it said nothing"
    return TrainingFailed(f"run {run_id} ended with exit code {code}: {said}; {told}")
