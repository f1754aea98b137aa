"""Errors of a benchmark's command in one line."""

from collections.abc import Iterator
from contextlib import contextmanager

from robojackson.errors import RoboJacksonError


@contextmanager
def errors_in_one_line() -> Iterator[None]:
    """Leave the process with one line, instead of a traceback, for an error of ours."""
    try:
        yield
    except RoboJacksonError as error:
        raise SystemExit(f"{type(error).__name__}: {error}") from error
