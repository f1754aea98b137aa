"""The clips that are shipped: `clips/` of a checkout and of an installed package."""

from pathlib import Path

from robojackson.errors import MissingDependency
from robojackson.pipeline.app_folder import app_folder


def bundled(name: str) -> Path:
    """Return the path of a bundled clip, from any working directory.

    Raises:
        MissingDependency: it is not there.
    """
    path = app_folder() / "clips" / name
    if not path.is_file():
        raise MissingDependency(
            f"{path}: the bundled clip is missing; install robojackson again, or give a video file"
        )
    return path
