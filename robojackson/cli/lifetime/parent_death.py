"""End a child process when its parent ends, in whatever way.

Imports only small modules of the standard library: `supervisor` runs before everything else.
"""

import os
import signal
import sys
import time

DIE_WITH_PARENT = 1
"""PR_SET_PDEATHSIG of prctl(2)."""
WATCH_S = 2.0
"""Interval at which a process checks that its parent still lives, seconds."""


def end_with_parent(parent: int) -> bool:
    """Have the kernel kill this process when its parent ends; return whether the parent still
    lives.

    The kernel's parent is the thread that started this process; `watch_parent` is for a parent that
    starts processes from threads that end before it.
    """
    if sys.platform == "linux":
        import ctypes

        ctypes.CDLL(None).prctl(DIE_WITH_PARENT, signal.SIGKILL, 0, 0, 0)
    return os.getppid() == parent


def watch_parent(parent: int) -> None:
    """End this process at most `WATCH_S` after its parent, by a thread that watches it."""
    import threading

    threading.Thread(target=_watch, args=(parent,), daemon=True).start()


def _watch(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(WATCH_S)
    os._exit(1)
