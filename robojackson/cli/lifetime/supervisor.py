"""Supervise a command: acknowledge Ctrl-C and SIGTERM at once, and enforce them.

The command runs in a worker, forked before anything heavy is imported; its parent waits for
signals. So the answer depends neither on the worker's interpreter lock nor on its main thread,
which a compilation or a solver may block for ten seconds. On the first signal the supervisor

    1. writes one line on stderr, and sends SIGINT to the worker and SIGTERM to the trainings whose
       learning no checkpoint holds yet;
    2. waits `GRACE_S`, or for those trainings to save (at most `SECONDS_TO_SAVE`);
    3. kills what is left of the worker and of the processes that it started (`orphans`), removes
       the files that they were writing, and writes how to resume. The exit code is 130.

A second signal leads to step 3 at once. The worker has its own process group, so that a terminal's
Ctrl-C reaches it once, through the supervisor. Linux only; elsewhere the command runs by itself and
Python handles Ctrl-C. Imports only the standard library.
"""

import fcntl
import os
import select
import signal
import sys
import time
from collections.abc import Callable
from contextlib import suppress

from robojackson.cli.lifetime.interruption import (
    INTERRUPTED,
    STOPS,
    UNSAVED,
    as_line,
    become_worker,
    is_guarded,
    same_command,
)
from robojackson.cli.lifetime.orphans import half_written, holding, kill_all, marked, new_mark
from robojackson.cli.lifetime.process_group import SECONDS_TO_SAVE, signal_group

GRACE_S = 1.5
"""Time for the worker to end by itself, seconds."""
GRACE_AFTER_SAVING_S = 1.0
"""Time for the worker after the last checkpoint was saved, seconds."""
SAME_S = 0.25
"""Signals closer than this count as one: wrappers forward a Ctrl-C that also reaches us,
seconds."""
POLL_S = 0.05
WATCHED = {*STOPS, signal.SIGCHLD, signal.SIGTSTP, signal.SIGCONT}
FIRST_FILE = 3
"""The first file descriptor after stdin, stdout and stderr, one of which may be closed."""
KILLED = 128
"""Offset of a shell's exit code from the number of the signal that killed a process."""


def guarded(command: Callable[[], int]) -> int:
    """Run a command in a worker under a supervisor; return its exit code, in both processes.

    A process that one of our own has started has a supervisor already and runs the command itself.
    """
    if sys.platform != "linux" or is_guarded():
        return command()
    signal.pthread_sigmask(signal.SIG_BLOCK, WATCHED)
    signal.signal(signal.SIGCHLD, signal.SIG_DFL)  # if ignored, the worker's exit code is lost
    mark, supervisor = new_mark(), os.getpid()
    read, write = _pipe()
    worker = os.fork()
    if not worker:
        become_worker(supervisor, mark, write)
        signal.pthread_sigmask(signal.SIG_UNBLOCK, WATCHED)
        return command()
    os.close(write)
    with suppress(OSError):  # the worker does the same, in either order
        os.setpgid(worker, worker)
    code = _wait(worker, mark)
    if code == INTERRUPTED:
        _write(_received(read) or f"interrupted: resume: {same_command()}")
    elif code < 0:
        cause = " (by hand, or out of memory)" if code == -signal.SIGKILL else ""
        named = signal.Signals(-code).name
        _write(f"the command was killed by {named}{cause}; resume: {same_command()}")
        return KILLED - code
    return code


def _pipe() -> tuple[int, int]:
    """Return both ends of a pipe, neither in the place of a standard file that is closed."""
    ends = os.pipe()
    read, write = (fcntl.fcntl(end, fcntl.F_DUPFD_CLOEXEC, FIRST_FILE) for end in ends)
    for end in ends:
        os.close(end)
    return read, write


def _wait(worker: int, mark: str) -> int:
    """Wait for the end of the worker, or for a signal to end it; return the exit code."""
    while True:
        number = signal.sigwait(WATCHED)
        if number in STOPS:
            _end(worker, mark)
            return INTERRUPTED
        if number == signal.SIGTSTP:
            signal_group(worker, signal.SIGSTOP)
            os.kill(os.getpid(), signal.SIGSTOP)
        elif number == signal.SIGCONT:
            signal_group(worker, signal.SIGCONT)
        ended, status = os.waitpid(worker, os.WNOHANG)
        if ended:
            return os.waitstatus_to_exitcode(status)


def _end(worker: int, mark: str) -> None:
    """Acknowledge a signal, and end the worker with all that it started."""
    began = time.monotonic()
    until = began + GRACE_S
    processes = {worker, *marked(mark)}
    files = half_written(processes)  # now: the worker may kill their writers
    stopped = _stop_trainings(processes, {worker})
    _write(_acknowledgement(len(stopped), SECONDS_TO_SAVE))
    os.kill(worker, signal.SIGINT)
    while not _has_ended(worker) and time.monotonic() < until:
        again = signal.sigtimedwait({*STOPS, signal.SIGCHLD}, POLL_S)
        now = time.monotonic()
        if again and again.si_signo in STOPS and now > began + SAME_S:
            break
        processes = {worker, *marked(mark)}
        files |= half_written(processes)
        saving = _stop_trainings(processes, stopped | {worker})
        if saving - stopped:
            _write(_acknowledgement(len(saving), SECONDS_TO_SAVE))
        stopped |= saving
        if saving:
            until = max(until, min(now + GRACE_AFTER_SAVING_S, began + SECONDS_TO_SAVE))
    files |= kill_all(mark, worker)
    signal_group(worker, signal.SIGKILL)  # forks of the worker carry no mark
    os.waitpid(worker, 0)
    for file in files:
        with suppress(OSError):  # its folder may be gone, too
            file.unlink(missing_ok=True)


def _stop_trainings(processes: set[int], stopped: set[int]) -> set[int]:
    """Return the processes that have learning to save; send SIGTERM to those not yet stopped."""
    saving = holding(UNSAVED, processes)
    for training in saving - stopped:
        with suppress(ProcessLookupError):
            os.kill(training, signal.SIGTERM)
    return saving


def _has_ended(worker: int) -> bool:
    """Return whether the worker has ended; it is not reaped."""
    return os.waitid(os.P_PID, worker, os.WEXITED | os.WNOHANG | os.WNOWAIT) is not None


def _acknowledgement(saving: int, seconds: float) -> str:
    """Return the line about the end that follows a signal."""
    if not saving:
        return "interrupted, ending ..."
    what = "the training is saving its checkpoint"
    if saving > 1:
        what = f"{saving} trainings are saving their checkpoints"
    return f"interrupted: {what} (up to {seconds:.0f} s; Ctrl-C again ends at once)"


def _received(last_line: int) -> str:
    """Return the line that the worker left, empty where it left none."""
    os.set_blocking(last_line, False)
    try:
        return os.read(last_line, 1 << 16).decode()
    except BlockingIOError:
        return ""


def _write(text: str) -> None:
    """Write a line on stderr in place of a progress line; do nothing where stderr is closed."""
    start = "\r\x1b[2K" if os.isatty(2) else ""
    with suppress(OSError, ValueError):
        if select.select([], [2], [], 0)[1]:
            os.write(2, f"{start}{as_line(text)}\n".encode(errors="backslashreplace"))
