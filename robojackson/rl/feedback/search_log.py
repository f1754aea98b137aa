"""Log lines about a search for feedback, for callers that show no progress of their own."""

import logging
import time
from collections.abc import Callable

log = logging.getLogger(__name__)
EVERY_S = 15.0
"""Seconds between two lines of one search."""


class SearchLog:
    """A `Progress` that logs what is done at most every `EVERY_S` seconds.

    Args:
        length_s: Length of the motion, s.
        clock: Seconds from any moment on.
    """

    def __init__(self, length_s: float, clock: Callable[[], float] = time.monotonic) -> None:
        self._length, self._clock = length_s, clock
        self._begun = self._last = clock()
        log.info(
            "computing the feedback along %.1f s of motion, once: seconds, or minutes where the "
            "robot falls from the motion itself and a path beside it is searched",
            length_s,
        )

    def __call__(self, name: str, step: int, total: int) -> None:
        """Log the part that is being done, its share, and the time so far."""
        now = self._clock()
        if now - self._last < EVERY_S:
            return
        self._last = now
        log.info(
            "feedback along %.1f s of motion: %s, %.0f %%, %.0f s so far",
            self._length, name, 100 * step / max(total, 1), now - self._begun,
        )  # fmt: skip
