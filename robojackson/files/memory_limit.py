"""A ceiling on the memory that reading something from outside may take in this process."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

MOST = 2**29
"""Bytes beyond what the process has when it begins to read."""

VIDEO_MEMORY = 5 * 2**29
"""The same while a stranger's video is read: room for the detector and the stacks of its threads,
of which a tenth becomes resident."""


@contextmanager
def limited_memory(most: int = MOST) -> Iterator[None]:
    """Inside, an allocation beyond `most` further bytes fails instead of filling the machine.

    What fails raises `MemoryError`, or the error of the library that asked for it. Linux only.
    """
    if sys.platform != "linux":
        yield
        return
    import resource

    before = resource.getrlimit(resource.RLIMIT_DATA)
    limits = [data_bytes() + most, *(limit for limit in before if limit != resource.RLIM_INFINITY)]
    resource.setrlimit(resource.RLIMIT_DATA, (min(limits), before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_DATA, before)


def data_bytes() -> int:
    """Return how much memory of its own this process has mapped, bytes."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(int(line.split()[1]) * 1024 for line in lines if line.startswith("VmData:"))
