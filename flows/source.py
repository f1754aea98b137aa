"""What the SOURCE of a dance means: a file, a folder, or the name of a dance."""

import os
from pathlib import Path

from robojackson.errors import MissingDependency, UnreadableVideo

SUFFIXES = (".mp4", ".mov", ".m4v", ".mkv", ".webm", ".avi", ".gif")
BUNDLED = Path(__file__).parent.parent / "clips"
DEFAULT = "hip_shake.mp4"


def resolve(source: str | None) -> Path:
    """The file or folder that a user means; without one, the bundled hip shake.

    Raises:
        UnreadableVideo: it looks like a path and is not there, or it is the name of a dance.
        MissingDependency: the bundled clips are not here.
    """
    if source is None:
        return _bundled(DEFAULT)
    path = Path(source)
    if path.exists():
        return path
    if os.sep in source or path.suffix.lower() in SUFFIXES:
        raise UnreadableVideo(f"{source}: no such file or folder")
    raise UnreadableVideo(
        f"{source!r} is no file but the name of a dance: `robojackson find` looks for its videos"
    )


def is_name(source: str | None) -> bool:
    """Whether a SOURCE is the name of a dance: no path, and nothing that looks like one."""
    if source is None or Path(source).exists():
        return False
    return os.sep not in source and Path(source).suffix.lower() not in SUFFIXES


def _bundled(name: str) -> Path:
    path = BUNDLED / name
    if not path.is_file():
        raise MissingDependency(
            f"the bundled clip {name} is part of the checkout and not of the installed package: "
            "give a video file"
        )
    return path
