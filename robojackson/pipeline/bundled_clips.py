"""The clips that are part of the checkout."""

from pathlib import Path

from robojackson.errors import MissingDependency

BUNDLED = Path(__file__).parents[2] / "clips"


def bundled(name: str) -> Path:
    """A clip of the checkout, wherever the command is given.

    Raises:
        MissingDependency: the bundled clips are not here.
    """
    path = BUNDLED / name
    if not path.is_file():
        raise MissingDependency(
            f"the bundled clip {name} is part of the checkout and not of the installed package: "
            "give a video file"
        )
    return path
