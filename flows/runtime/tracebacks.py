"""Prefect's log of a wrong input: no traceback, and no message twice.

Prefect logs an error of a stage as an exception and as a state, of the task and of the flow; the
command ends with the same line again. On the terminal that last line is enough. Prefect's pages
(its API's handlers) still get every record, without the traceback.
"""

import logging
from collections import deque

from robojackson.errors import RoboJacksonError

ADVERTISEMENT = "\nSee https://docs.prefect.io"
"""Prefect's second line where it starts its temporary server."""
RETRY = "Retry"
"""In the message of an exception after which the stage is tried again."""
ENDED = "Finished in state"
NOT_KEPT = "Failed to write result: Failed to serialize object of type"
"""Beginning of what Prefect says of a stage's error, which is no result that could be kept."""
REMEMBERED = 64
"""Errors whose states are still to come."""


def without_tracebacks() -> None:
    """Install both filters; a second time changes nothing."""
    for name in ("prefect.flow_runs", "prefect.task_runs"):
        logging.getLogger(name).addFilter(_without_traceback)
    for handler in logging.getLogger().handlers:
        if type(handler).__module__.startswith("prefect."):
            handler.addFilter(_once)


class Once:
    """A filter of a handler for people: without what the command itself prints at its end."""

    def __init__(self) -> None:
        self._errors: deque[str] = deque(maxlen=REMEMBERED)

    def __call__(self, record: logging.LogRecord) -> bool:
        """Return whether to write a record."""
        _shorten(record)
        error = _error_of(record)
        if error is not None:
            self._errors.append(str(error))
            return RETRY in record.getMessage()
        text = record.getMessage()
        if text.startswith(NOT_KEPT):
            return False
        return not (text.startswith(ENDED) and any(known in text for known in self._errors))


_once = Once()


def _without_traceback(record: logging.LogRecord) -> bool:
    error = _error_of(record)
    if error is not None:
        record.exc_info = None
        record.input_error = error
    return True


def _error_of(record: logging.LogRecord) -> RoboJacksonError | None:
    """Return the fault of the input that a record is about."""
    error = record.exc_info[1] if record.exc_info else getattr(record, "input_error", None)
    return error if isinstance(error, RoboJacksonError) else None


def _shorten(record: logging.LogRecord) -> None:
    if isinstance(record.msg, str):
        record.msg = record.msg.split(ADVERTISEMENT)[0]
