"""Processes that take work off the flow: decoding strangers' videos uses all cores and may crash.

They are kept for the whole flow, because loading the pose model takes seconds. A clip that kills
its process harms no other: work under way is done again, each in a process of its own.
"""

import os
import signal
import threading
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import get_context
from typing import ParamSpec, TypeVar

from robojackson.cli.lifetime.parent_death import watch_parent
from robojackson.errors import UnreadableVideo

P = ParamSpec("P")
R = TypeVar("R")

_lock = threading.Lock()
_pool: ProcessPoolExecutor | None = None


def cores() -> int:
    """Return the cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def in_worker(function: Callable[P, R], *args: P.args, **kwargs: P.kwargs) -> R:
    """Call a function of a module in another process.

    Raises:
        UnreadableVideo: the process died of it, twice.
    """
    try:
        return _shared().submit(function, *args, **kwargs).result()
    except BrokenProcessPool:
        _forget()
    with _processes(1) as alone:
        try:
            return alone.submit(function, *args, **kwargs).result()
        except BrokenProcessPool as cause:
            raise UnreadableVideo("decoding it killed the process") from cause


def _shared() -> ProcessPoolExecutor:
    global _pool
    with _lock:
        _pool = _pool or _processes(cores())
        return _pool


def _forget() -> None:
    """Drop the pool if it is broken; another thread may have replaced it already."""
    global _pool
    with _lock:
        if _pool is not None and getattr(_pool, "_broken", True):
            _pool.shutdown(wait=False, cancel_futures=True)
            _pool = None


def _processes(count: int) -> ProcessPoolExecutor:
    context = get_context("spawn")
    return ProcessPoolExecutor(
        count, mp_context=context, initializer=_begin, initargs=(os.getpid(),)
    )


def _begin(parent: int) -> None:
    """Use one thread a library, leave Ctrl-C to the parent, and end with it."""
    os.environ["OMP_NUM_THREADS"] = "1"
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    watch_parent(parent)
    import cv2

    cv2.setNumThreads(1)
