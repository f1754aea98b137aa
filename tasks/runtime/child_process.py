"""Heavy work as an operating-system process of its own, which never imports Prefect.

It dies with the task: by SIGTERM and then SIGKILL to its process group when the task is cancelled,
by the kernel when this process is killed.
"""

import asyncio
import os
import signal
from asyncio.subprocess import Process
from collections import deque
from collections.abc import AsyncIterator, Callable
from pathlib import Path

from robojackson.cli.lifetime.asyncio_process import running
from robojackson.cli.lifetime.process_group import SECONDS_TO_SAVE
from robojackson.errors import TrainingCrashed, TrainingFailed
from robojackson.pipeline.app_folder import app_folder
from tasks.runtime.run_logger import run_logger

LOG, LONGEST = "process.log", 2**16
"""File of what a process says; bytes of a line beyond which it is cut into parts."""


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
    last: deque[str] = deque(maxlen=5)
    async with running(command, environment(), SECONDS_TO_SAVE) as process:
        try:
            async with asyncio.timeout(limit_s):
                forward = _forward(process, work / LOG, last)
                answer, _ = await asyncio.gather(_read(process), forward)
                await process.wait()
        except TimeoutError:
            raise TrainingFailed(f"run {run_id} did not end within {limit_s:.0f} s") from None
    if process.returncode:
        raise _cause(run_id, process.returncode, work, last)
    return answer


def environment() -> dict[str, str]:
    """Return this process's environment with one OpenMP thread; stages of the same checkout or
    package."""
    found = os.environ.get("PYTHONPATH")
    path = os.pathsep.join([str(app_folder()), *([found] if found else [])])
    return {**os.environ, "OMP_NUM_THREADS": "1", "PYTHONPATH": path, "PYTHONUNBUFFERED": "1"}


async def _forward(process: Process, log_file: Path, last: deque[str]) -> None:
    say: Callable[[str], None] = run_logger().info
    with log_file.open("a", encoding="utf-8") as file:
        async for line in _lines(process):
            file.write(f"{line}\n")
            file.flush()
            last.append(line)
            say(line)


async def _lines(process: Process) -> AsyncIterator[str]:
    """Yield what a process says, line by line; one that is too long in parts."""
    assert process.stderr is not None
    rest = b""
    while chunk := await process.stderr.read(LONGEST):
        *lines, rest = (rest + chunk).split(b"\n")
        if len(rest) > LONGEST:
            lines, rest = [*lines, rest], b""
        for raw in lines:
            if line := raw.decode(errors="replace").rstrip():
                yield line
    if line := rest.decode(errors="replace").rstrip():
        yield line


async def _read(process: Process) -> bytes:
    assert process.stdout is not None
    return await process.stdout.read()


def _cause(run_id: str, code: int, work: Path, last: deque[str]) -> TrainingFailed:
    """Return the error of a run: which one died, why, and where its log is."""
    log = f"log: {work / LOG}"
    if code < 0:
        how = f"was killed by {signal.Signals(-code).name}"
        if -code == signal.SIGKILL:
            how += " (by hand, or out of memory)"
        return TrainingCrashed(f"run {run_id} {how}; {log}; the same command resumes it")
    said = last[-1] if last else "no message"
    return TrainingFailed(f"run {run_id} ended with exit code {code}: {said}; {log}")
