"""Processes in a group of their own: a signal reaches each of them, a terminal's Ctrl-C none.

Only what is small of the standard library is imported here: `supervisor` precedes everything else.
"""

import os
import signal
from contextlib import suppress
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import subprocess

SECONDS_TO_SAVE = 30.0
"""What a training that is stopped gets to write its checkpoint before it is killed, seconds."""


def signal_group(leader: int, number: signal.Signals) -> None:
    """Send a signal to a process group; one that has ended is left alone.

    Args:
        leader: Process id of the first process of the group.
    """
    with suppress(ProcessLookupError):  # it may have ended a moment ago
        os.killpg(leader, number)


def end_group(
    process: "subprocess.Popen[bytes]", grace_s: float, request: signal.Signals = signal.SIGTERM
) -> None:
    """End the group of a process and reap the process: a request, a wait, then SIGKILL.

    Args:
        process: Started with `start_new_session=True`; nothing is sent if it was reaped before.
        grace_s: Time to end by itself, seconds.
        request: The first signal.
    """
    import subprocess

    for number, limit_s in ((request, grace_s), (signal.SIGKILL, None)):
        if process.poll() is None:
            signal_group(process.pid, number)
            with suppress(subprocess.TimeoutExpired):
                process.wait(limit_s)
