"""Lines for what no command foresees: bugs, libraries that cannot be loaded, numbers that are none.

Imports nothing heavy: it is loaded with every command.
"""

import math
import os
import traceback
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import typer

TRACEBACK, LONGEST_CAUSE = "ROBOJACKSON_TRACEBACK", 300
"""Environment variable that shows the traceback of an unexpected error; length of its line."""
USAGE_ERROR: Any = typer.BadParameter.__bases__[0]
"""Exception of typer for arguments that it cannot parse; it has no public name there."""
BODY = "<module>"
"""Name in a traceback of the code that runs while a module is imported."""
PACKAGES = ("site-packages", "dist-packages")
OURS = ("robojackson", "flows", "tasks", "storage", "configs")


def require_finite(options: Mapping[str, object]) -> None:
    """Raise typer's error of usage for NaN and infinity, which it takes as numbers."""
    for name, value in options.items():
        if isinstance(value, float) and not math.isfinite(value):
            option = f"--{name.strip('_').replace('_', '-')}"
            raise typer.BadParameter(f"{option} is {value}, expected a finite number")


def unexpected(cause: Exception) -> str:
    """Return the line about an error that none of our own classes foresees.

    Raises:
        Exception: the cause itself, where it is typer's, or the user wants the traceback.
    """
    if isinstance(cause, USAGE_ERROR) or TRACEBACK in os.environ:
        raise cause
    place = traceback.extract_tb(cause.__traceback__)[-1]
    message = " ".join(str(cause).split())[:LONGEST_CAUSE]
    if library := _not_loaded(cause):
        return (
            f"BadConfiguration: {library} cannot be loaded: {type(cause).__name__}: {message}; "
            "look at the environment variables that it reads"
        )
    return (
        f"InternalError: {type(cause).__name__}: {message} ({Path(place.filename).name}:"
        f"{place.lineno}); the input is unexpected, or this is a bug: "
        f"{TRACEBACK}=1 shows where, `robojackson doctor --report` is for an issue"
    )


def _not_loaded(cause: Exception) -> str:
    """Return the library that raised an error while it was imported; empty for any other error."""
    library = ""
    for frame in traceback.extract_tb(cause.__traceback__):
        owner = _owner(frame.filename)
        if owner in OURS:
            library = ""
        elif owner and frame.name == BODY:
            library = owner
    return library


def _owner(file: str) -> str:
    """Return the top-level package of a source file; empty for Python's own."""
    parts = Path(file).parts
    for folder in PACKAGES:
        if folder in parts:
            return parts[parts.index(folder) + 1].removesuffix(".py")
    return OURS[0] if Path(file).is_relative_to(Path(__file__).parents[3]) else ""
