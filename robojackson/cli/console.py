"""Input and output of commands: the answer on stdout, the rest on stderr, one line for an error."""

import functools
import json
import os
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ParamSpec

import typer
from pydantic import ValidationError

from robojackson.api.progress_bar import bar as bar
from robojackson.cli.library_output import log_to_stderr as log_to_stderr
from robojackson.cli.library_output import silence_libraries
from robojackson.cli.lifetime.interruption import INTERRUPTED, conclude, printable
from robojackson.cli.lifetime.interruption import complain as complain
from robojackson.cli.lifetime.interruption import same_command as same_command
from robojackson.cli.lifetime.unexpected import USAGE_ERROR as USAGE_ERROR
from robojackson.cli.lifetime.unexpected import require_finite, unexpected
from robojackson.errors import RoboJacksonError, StoreError
from robojackson.files.json_types import to_json_types as to_json_types

P = ParamSpec("P")
SECONDS_BETWEEN_LINES = 15.0
"""Interval of progress lines where every line stays, seconds."""

APP_PACKAGES = ("prefect", "fastapi", "sqlalchemy", "yt_dlp", "uvicorn", "starlette", "httpx")
"""Line that installs the extra `app`: without it only the commands of one stage work."""
INSTALL_APP = "pip install 'robojackson[app]'"


@dataclass(frozen=True)
class CommandResult:
    """The result of a command.

    Attributes:
        data: The object that `--json` prints.
        code: Exit code.
        text: Lines for a person, in place of all of `data`.
    """

    data: Mapping[str, Any]
    code: int = 0
    text: Sequence[str] = ()


class Interrupted(Exception):
    """Ctrl-C with a message about how to go on."""


def command(body: Callable[P, CommandResult]) -> Callable[P, None]:
    """Make a command of a function: print its result, turn errors into one line and an exit code.

    The function has a keyword `as_json`; while it runs, stdout is stderr, so that no library can
    write beside the result.
    """

    @functools.wraps(body)
    def run(*args: P.args, **kwargs: P.kwargs) -> None:
        silence_libraries()
        require_finite(kwargs)
        try:
            with stdout_is_stderr():
                answer = body(*args, **kwargs)
        except RoboJacksonError as cause:
            _leave(1, f"{type(cause).__name__}: {cause}")
        except ModuleNotFoundError as cause:
            if (cause.name or "").partition(".")[0] not in APP_PACKAGES:
                raise
            _leave(1, f"MissingDependency: {cause.name} is not installed: {INSTALL_APP}")
        except OSError as cause:
            _leave(1, f"StoreError: {cause}")
        except Interrupted as cause:
            _leave_interrupted(f"interrupted: {cause}")
        except KeyboardInterrupt:
            _leave_interrupted(f"interrupted: resume: {same_command()}")
        except MemoryError:
            _leave(1, "StoreError: out of memory: the input is too large for this machine")
        except typer.Exit:
            raise
        except Exception as cause:
            _leave(1, unexpected(cause))
        try:
            print_result(answer, as_json=bool(kwargs.get("as_json")))
        except BrokenPipeError:  # the reader closed the pipe
            raise
        except OSError as cause:
            sys.stdout = open(os.devnull, "w")  # noqa: SIM115 (nothing is left to be flushed)
            _leave(1, f"StoreError: the answer cannot be written to stdout: {cause.strerror}")
        if answer.code:
            raise typer.Exit(answer.code)

    return run


def print_result(answer: CommandResult, as_json: bool) -> None:
    """Print a result: one JSON object, or lines for a person."""
    data = to_json_types(answer.data)
    if as_json:
        sys.stdout.write(json.dumps(data) + "\n")
    else:
        text = "\n".join(answer.text or lines(data)).split("\n")
        sys.stdout.write("\n".join(map(printable, text)) + "\n")
    sys.stdout.flush()


def lines(data: Mapping[str, object], indent: int = 0) -> Iterator[str]:
    """Yield a mapping as lines for a person: one line a value, numbers with four digits."""
    width = max((len(str(key)) for key in data), default=0)
    for key, value in data.items():
        head = " " * indent + str(key)
        if isinstance(value, Mapping):
            yield head
            yield from lines(value, indent + 2)
        elif isinstance(value, list) and value and isinstance(value[0], Mapping):
            for item in value:
                yield head
                yield from lines(item, indent + 2)
        else:
            yield f"{head:<{width + indent}}  {_format_value(value)}"


def table(rows: Mapping[str, Mapping[str, object]], columns: Sequence[str]) -> list[str]:
    """Return rows by name under a head, columns aligned."""
    cells = [["", *columns]]
    cells += [
        [name, *(_format_value(row.get(key)) for key in columns)] for name, row in rows.items()
    ]
    widths = [max(len(line[i]) for line in cells) for i in range(len(cells[0]))]
    return [
        "  ".join(cell.ljust(width) for cell, width in zip(line, widths, strict=True)).rstrip()
        for line in cells
    ]


@contextmanager
def ticker() -> Iterator[Callable[[str], None]]:
    """Yield a function that writes a line on stderr over the last one; below it without a
    terminal."""
    live = sys.stderr.isatty()

    def write_line(line: str) -> None:
        line = printable(line)
        sys.stderr.write(f"\r\x1b[2K{line}" if live else f"{line}\n")
        sys.stderr.flush()

    yield write_line
    if live:
        sys.stderr.write("\n")


@contextmanager
def stages() -> Iterator[Callable[[str, int, int], None]]:
    """Yield a function that reports progress of named parts: in steps of a tenth; less often in
    logs."""
    reported: dict[str, int] = {}
    last = time.monotonic()
    every_s = 0.0 if sys.stderr.isatty() else SECONDS_BETWEEN_LINES
    with ticker() as write_line:

        def advance(name: str, done: int, total: int) -> None:
            nonlocal last
            tenth, now = 10 * done // max(total, 1), time.monotonic()
            if tenth > reported.get(name, 0) and now - last >= every_s:
                reported[name], last = tenth, now
                write_line(f"{name} {tenth}0 %")

        yield advance


@contextmanager
def stdout_is_stderr() -> Iterator[None]:
    """Send everything written to file descriptor 1, also by C++, to stderr."""
    if sys.stdout is None:
        raise StoreError("stdout is closed: there is nowhere to write the answer")
    sys.stdout.flush()
    saved = os.dup(1)
    os.dup2(2, 1)
    try:
        yield
    finally:
        sys.stdout.flush()
        os.dup2(saved, 1)
        os.close(saved)


def usage_error(cause: Any) -> str:
    """Return typer's message about the arguments, with the value in question."""
    message = cause.format_message().rstrip(".")
    if isinstance(cause.__cause__, ValidationError):
        given = repr(cause.__cause__.errors()[0]["input"])
        message += "" if given in message else f", given {given}"
    return f"{message} (see --help)"


def _leave(code: int, line: str) -> None:
    complain(line)
    raise typer.Exit(code)


def _leave_interrupted(line: str) -> None:
    conclude(line)
    raise typer.Exit(INTERRUPTED)


def _format_value(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, list):
        return ", ".join(_format_value(inner) for inner in value)
    return "-" if value is None else str(value)


def relative_path(path: Path) -> str:
    """Return a path as short as possible from the current folder."""
    try:
        return str(path.relative_to(Path.cwd()))
    except ValueError:
        return str(path)
