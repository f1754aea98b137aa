"""Work on many files of a backup at once, and how far it is."""

import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass, field
from typing import TypeVar

from storage.backup import Content

THREADS = 8
T = TypeVar("T")


@dataclass
class Progress:
    """Progress of a copy.

    Attributes:
        what: What is done to each file.
        total: Files.
        done: Files that are finished, unchanged ones too.
        copied: Bytes that were read or written.
    """

    what: str
    total: int
    done: int = 0
    copied: int = 0
    began: float = field(default_factory=time.monotonic)

    def __str__(self) -> str:
        seconds = max(time.monotonic() - self.began, 1e-3)
        rate = self.copied / 1e6 / seconds
        return (
            f"{self.what} {self.done:,} of {self.total:,} files, {self.copied / 1e6:,.1f} MB, "
            f"{rate:,.1f} MB/s"
        )


Report = Callable[[Progress], None]


def each_finished(work: Callable[[str], T], names: Iterable[str]) -> Iterator[tuple[str, T]]:
    """Yield the result of each name as it is finished; the first error ends the rest."""
    with ThreadPoolExecutor(THREADS) as pool:
        futures = {pool.submit(work, name): name for name in names}
        try:
            for future in as_completed(futures):
                yield futures[future], future.result()
        finally:
            pool.shutdown(wait=True, cancel_futures=True)


def megabytes(contents: Iterable[Content]) -> float:
    """Return the sum of sizes in millions of bytes."""
    return sum(content.size for content in contents) / 1e6
