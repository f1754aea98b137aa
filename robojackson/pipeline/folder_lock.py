"""A folder that one process locks at a time; the lock file is removed with the lock."""

import fcntl
import math
import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

from robojackson.errors import StoreError

FOR_EVER = math.inf
A_MOMENT = 2.0
"""Seconds for which a folder may be held only to check whether it is unlocked."""
POLL_S = 0.05


@contextmanager
def locked(
    folder: Path, name: str = "lock", patience_s: float = 0.0, holder: str = "another training"
) -> Iterator[None]:
    """Hold a folder for this thread; the kernel releases it when the process dies.

    Args:
        patience_s: Time to wait for the holder, seconds; infinite waits forever.
        holder: What holds it otherwise, for the message.
    Raises:
        StoreError: another process still holds it.
    """
    path = folder / name
    with _held(path, time.monotonic() + patience_s, holder):
        try:
            yield
        finally:
            path.unlink(missing_ok=True)


def _held(path: Path, until: float, holder: str) -> IO[str]:
    """Return the locked file; one that was removed between opening and locking is created again."""
    while True:
        path.parent.mkdir(parents=True, exist_ok=True)
        file = path.open("w")
        _lock(file, until, holder)
        if path.exists() and os.path.samestat(os.fstat(file.fileno()), path.stat()):
            return file
        file.close()


def _lock(file: IO[str], until: float, holder: str) -> None:
    while True:
        try:
            return fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            if time.monotonic() >= until:
                file.close()
                raise StoreError(
                    f"{Path(file.name).parent}: {holder} is running there; wait for it to end, "
                    "then give the same command again"
                ) from None
            time.sleep(POLL_S)
