"""Files of configurations by their names.

A name such as `smoke` or `robots/humanoid` is a file of the user's `./configs` (or of the folder
that ROBOJACKSON_CONFIGS names), else of the shipped ones; a name with a YAML suffix is a path.
"""

import os
import re
from pathlib import Path

from robojackson.errors import BadConfiguration, UnknownName
from robojackson.pipeline.app_folder import CONFIGS, app_folder

SHIPPED = app_folder() / "configs"
SUFFIXES = (".yaml", ".yml")
TOP_KINDS = TOP, BY_PATH = ("configuration", "configuration file")
"""What errors call a name of the top folder, and a path."""


def find(name_or_path: str | Path) -> Path:
    """Return the file of a configuration.

    Raises:
        UnknownName: there is no such file; the message lists those that exist.
    """
    given = Path(name_or_path)
    if given.suffix in SUFFIXES:
        if given.is_file():
            return given
        raise UnknownName(BY_PATH, str(given), "as a path", names())
    for base in folders():
        path = Path(os.path.normpath(base / f"{given}.yaml"))  # a link may lead out, `..` not
        if path.is_file() and path.is_relative_to(os.path.normpath(base)):
            return path
    parent, slash, name = str(name_or_path).rpartition("/")  # Path drops an empty name
    folder = Path(parent).name
    kind = re.sub("ies$", "y", folder).removesuffix("s") or TOP
    raise UnknownName(kind, name, f"configs/{parent}{slash}{name}.yaml", names(folder))


def folders() -> list[Path]:
    """Return where named configurations are looked for: the user's folder first, then the shipped
    one.

    Raises:
        BadConfiguration: the variable names no folder.
    """
    named = os.environ.get(CONFIGS)
    own = Path(named or "configs").absolute()
    if named and not own.is_dir():
        raise BadConfiguration(
            f"{CONFIGS} is {named!r}, and {own} is no folder; a worker needs an absolute path"
        )
    return [own, SHIPPED] if own != SHIPPED and own.is_dir() else [SHIPPED]


def names(folder: str = "") -> tuple[str, ...]:
    """Return the names of all configurations, or of those of one kind, such as `robots`."""
    found = {path.stem for base in folders() for path in (base / folder).glob("*.yaml")}
    return tuple(sorted(found))


def display_name(path: Path) -> str:
    """Return the name of the file for messages."""
    inside = path.is_relative_to(SHIPPED)
    return f"configs/{path.relative_to(SHIPPED).as_posix()}" if inside else str(path)
