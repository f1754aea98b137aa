"""The robots of `configs/robots`, by name, and those of a user's own files, by path."""

import os
import platform
from dataclasses import replace
from pathlib import Path

from robojackson.errors import BadConfiguration, UnknownName
from robojackson.pipeline.configuration_files import SUFFIXES, find, names
from robojackson.pipeline.yaml_loader import load
from robojackson.robot.description import RobotDescription

FOLDER = "robots"
MODELS = (".xml", ".mjcf", ".urdf")
"""Suffixes of what a description names, and is not."""


def robot_names() -> tuple[str, ...]:
    """Return the names of all robots."""
    return names(FOLDER)


def is_file(robot: str) -> bool:
    """Return whether a robot is given by the path of its file: it has a separator or a file's
    suffix."""
    separators = [sep for sep in (os.sep, os.altsep) if sep]
    suffix = Path(robot).suffix.lower()
    return suffix in (*SUFFIXES, *MODELS) or any(sep in robot for sep in separators)


def describe_robot(robot: str) -> RobotDescription:
    """Return the description of a robot.

    Args:
        robot: Name of one of `configs/robots`, or the path of a YAML file.

    Raises:
        UnknownName: there is no such robot; the message lists those that are.
        BadConfiguration: a wrong key or value, or another name in the file than that of the file:
            what is made for one robot would be taken for another's.
    """
    if is_file(robot):
        return read_description(Path(robot))
    found = load(RobotDescription, f"{FOLDER}/{robot}")
    if found.name != robot:
        raise BadConfiguration(
            f"configs/{FOLDER}/{robot}.yaml: name is {found.name!r}; it must be that of the file, "
            f"{robot!r}"
        )
    folder = find(f"{FOLDER}/{robot}").absolute().parent
    return replace(found, file="", mjcf=_beside(found.mjcf, folder) or found.mjcf)


def read_description(file: Path) -> RobotDescription:
    """Return the description of a robot in a YAML file anywhere; its model is found from anywhere.

    Raises:
        UnknownName: there is no such file on this machine.
        BadConfiguration: a wrong key or value, or no YAML.
    """
    path = Path(os.path.abspath(file.expanduser()))
    if not path.is_file():
        raise UnknownName("robot", str(file), f"no file {path} on {platform.node()}", robot_names())
    if path.suffix.lower() not in SUFFIXES:
        first = f"; `robojackson robots new {file}` writes a first one"
        offered = first if path.suffix.lower() in MODELS else ""
        raise BadConfiguration(f"{file}: a robot is described by a .yaml file{offered}")
    found = load(RobotDescription, path)
    model = (
        found.mjcf if _in_package(found.mjcf) else os.path.abspath(Path(found.mjcf).expanduser())
    )
    return replace(found, file=str(path), mjcf=_beside(found.mjcf, path.parent) or model)


def _in_package(mjcf: str) -> bool:
    package, colon, _ = mjcf.partition(":")
    return bool(colon) and len(package) > 1 and package.isidentifier()


def _beside(mjcf: str, folder: Path) -> str | None:
    """Return the model from the folder of its description, where it is there."""
    model = folder / Path(mjcf).expanduser()
    return os.path.abspath(model) if not _in_package(mjcf) and model.is_file() else None
