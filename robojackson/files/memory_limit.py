"""Limit the memory that this process may allocate while it reads something from outside."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

MOST = 2**29
"""Bytes beyond what the process has when it begins to read."""

VIDEO_MEMORY = 5 * 2**29
"""The same while a foreign video is read: room for the detector and the stacks of its threads, of
which a tenth becomes resident."""


@contextmanager
def limited_memory(most: int = MOST) -> Iterator[None]:
    """Make an allocation beyond `most` further bytes fail instead of filling the machine.

    The failing allocation raises `MemoryError`, or an error of the library that made it. Linux
    only.
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
    """Return how much private memory this process has mapped, bytes."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(int(line.split()[1]) * 1024 for line in lines if line.startswith("VmData:"))
