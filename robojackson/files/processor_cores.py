"""How many cores of the processor a process may use: by its affinity, and by the quota of its
control group, as that of a container with `cpus: 2`."""

import math
import os
from collections.abc import Iterator
from contextlib import suppress
from functools import cache
from pathlib import Path

GROUPS, OWN = Path("/sys/fs/cgroup"), Path("/proc/self/cgroup")
"""Linux's control groups, and the file that names those of this process."""
MOST = 1 << 20
"""Cores of a process without a quota, before its affinity."""
V1 = ("cpu", "cpu,cpuacct")
"""Folders of the older control groups that may have a quota."""


def cores(groups: Path = GROUPS, own: Path = OWN) -> int:
    """Return the cores that this process may use, a part of one counting as one.

    Args:
        groups: Folder of the control groups.
        own: File that names those of the process.
    """
    here = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return max(1, min(here, _quota(groups, own)))


@cache
def _quota(groups: Path, own: Path) -> int:
    """Return the least quota, rounded up, read once a process: searches ask at every step."""
    return math.ceil(min(_quotas(groups, own), default=MOST))


def _quotas(groups: Path, own: Path) -> Iterator[float]:
    """Yield the quotas of the process's groups and of all that hold them, cores."""
    for folder in _folders(groups, own):
        with suppress(OSError, ValueError):
            quota, period = (folder / "cpu.max").read_text().split()
            yield float(quota) / float(period)  # `max` is no number
        with suppress(OSError, ValueError):
            quota, period = (
                (folder / f"cpu.cfs_{name}_us").read_text() for name in ("quota", "period")
            )
            if float(quota) > 0:
                yield float(quota) / float(period)


def _folders(groups: Path, own: Path) -> Iterator[Path]:
    """Yield the folders of the process's groups and of those that hold them; a container may see
    its own group as the top, under another name."""
    tops = (groups, *(groups / name for name in V1))
    yield from tops
    lines: list[str] = []
    with suppress(OSError, UnicodeDecodeError):
        lines = own.read_text().splitlines()
    for _, controllers, name in (line.split(":", 2) for line in lines if line.count(":") >= 2):
        if controllers and "cpu" not in controllers.split(","):
            continue
        for top in tops[1:] if controllers else tops[:1]:
            inside = top / name.strip("/")
            yield from (one for one in (inside, *inside.parents) if top in one.parents)
