"""A fault of the input in Prefect's log: no traceback anywhere, no repetition on the terminal."""

import logging

import pytest

from flows.runtime.tracebacks import Once
from robojackson.errors import SearchFailed

FAULT = SearchFailed("youtube: HTTP 404 not found")


def record(message: str, error: BaseException | None = None) -> logging.LogRecord:
    result = (type(error), error, None) if error else None
    return logging.LogRecord("prefect.task_runs", logging.ERROR, "", 0, message, (), result)


def test_what_the_command_says_at_its_end_is_said_once() -> None:
    once = Once()
    result = [
        record(f"Task run failed with exception: {FAULT!r}", FAULT),
        record(f'Finished in state Failed("Task run encountered an exception: {FAULT}")'),
        record(f"Encountered exception during execution: {FAULT!r}", FAULT),
        record(f'Finished in state Failed("Flow run encountered an exception: {FAULT}")'),
    ]
    assert not any(once(each) for each in result)


def test_that_an_error_is_no_result_is_not_said() -> None:
    reason = "Failed to serialize object of type 'MissingDependency' with serializer 'x'."
    assert not Once()(record(f"Failed to write result: {reason} Execution will continue"))
    assert Once()(record("Failed to write result: no space left on device"))


@pytest.mark.parametrize(
    "expected_message",
    [
        record("Task run failed with exception: ... - Retry 1/3 will start in 2 s", FAULT),
        record("Task run failed with exception: ZeroDivisionError()", ZeroDivisionError()),
        record("Finished in state Failed('ZeroDivisionError')"),
        record("Finished in state Completed()"),
    ],
)
def test_everything_else_is_still_written(expected_message: logging.LogRecord) -> None:
    once = Once()
    once(record("Task run failed", FAULT))
    assert once(expected_message)


def test_the_line_of_the_temporary_server_has_no_advertisement() -> None:
    result = record(
        "Starting temporary server on http://127.0.0.1:1\nSee https://docs.prefect.io/v3"
    )
    assert Once()(result)
    assert result.getMessage() == "Starting temporary server on http://127.0.0.1:1"
