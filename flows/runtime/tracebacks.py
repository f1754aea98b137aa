"""Tracebacks in Prefect's log: none for what is the input's fault."""

import logging

from robojackson.errors import RoboJacksonError


def without_tracebacks() -> None:
    """What is the input's fault is one line in Prefect's log."""
    for name in ("prefect.flow_runs", "prefect.task_runs"):
        logging.getLogger(name).addFilter(_without_traceback)


def _without_traceback(record: logging.LogRecord) -> bool:
    if record.exc_info and isinstance(record.exc_info[1], RoboJacksonError):
        record.exc_info = None
    return True
