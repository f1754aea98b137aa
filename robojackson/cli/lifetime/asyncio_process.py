"""A child process of an event loop, in its own group, which is ended on every way out."""

import asyncio
import signal
from asyncio.subprocess import PIPE, Process
from collections.abc import AsyncIterator, Mapping, Sequence
from contextlib import asynccontextmanager

from robojackson.cli.lifetime.process_group import signal_group


@asynccontextmanager
async def running(
    command: Sequence[str], environment: Mapping[str, str], grace_s: float
) -> AsyncIterator[Process]:
    """Start a process; on leaving, end its group unless it has ended.

    The command itself must end with its parent (`parent_death`) where this process may be killed.

    Args:
        environment: Whole environment of the process.
        grace_s: Time from SIGTERM to SIGKILL, seconds; a second cancellation cuts it short.
    Yields:
        The process, its stdout and stderr as streams.
    """
    process = await asyncio.create_subprocess_exec(
        *command, stdout=PIPE, stderr=PIPE, start_new_session=True, env=environment
    )
    try:
        yield process
    finally:
        await _end(process, grace_s)


async def _end(process: Process, grace_s: float) -> None:
    """Send SIGTERM to the group of a process, wait, kill it, and reap the process."""
    if process.returncode is not None:
        return
    signal_group(process.pid, signal.SIGTERM)
    try:
        async with asyncio.timeout(grace_s):
            await process.wait()
    except TimeoutError:
        await _kill(process)
    except asyncio.CancelledError:
        await _kill(process)
        raise


async def _kill(process: Process) -> None:
    signal_group(process.pid, signal.SIGKILL)
    await process.wait()
