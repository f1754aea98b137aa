"""Processes in their own group: a signal reaches each of them, a terminal's Ctrl-C none.

Imports only small modules of the standard library: `supervisor` runs before everything else.
"""

import os
import signal
from contextlib import suppress
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import subprocess

SECONDS_TO_SAVE = 30.0
"""Time for a stopped training to write its checkpoint before it is killed, seconds."""


def signal_group(leader: int, number: signal.Signals) -> None:
    """Send a signal to a process group; do nothing where it has ended.

    Args:
        leader: Process id of the first process of the group.
    """
    with suppress(ProcessLookupError):  # it may just have ended
        os.killpg(leader, number)


def end_group(
    process: "subprocess.Popen[bytes]", grace_s: float, request: signal.Signals = signal.SIGTERM
) -> None:
    """End the group of a process and reap the process: a first signal, a wait, then SIGKILL.

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
