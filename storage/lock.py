"""A folder that one process holds at a time; the file that says so goes away with it."""

import fcntl
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

from robojackson.errors import StoreError


@contextmanager
def locked(folder: Path, name: str = "lock", patient: bool = False) -> Iterator[None]:
    """Hold a folder for this thread; the kernel lets go when the process dies.

    Args:
        patient: Wait for whoever holds it.
    Raises:
        StoreError: somebody holds it, and there is no patience.
    """
    path = folder / name
    with _held(path, fcntl.LOCK_EX if patient else fcntl.LOCK_EX | fcntl.LOCK_NB):
        try:
            yield
        finally:
            path.unlink(missing_ok=True)


def _held(path: Path, how: int) -> IO[str]:
    """The locked file; one that was taken away between opening and locking is made anew."""
    while True:
        path.parent.mkdir(parents=True, exist_ok=True)
        file = path.open("w")
        try:
            fcntl.flock(file, how)
        except BlockingIOError:
            file.close()
            raise StoreError(
                f"{path.parent}: another training is running there; wait for it to end, "
                "then give the same command again"
            ) from None
        if path.exists() and os.path.samestat(os.fstat(file.fileno()), path.stat()):
            return file
        file.close()
