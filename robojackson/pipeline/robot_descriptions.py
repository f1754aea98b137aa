"""The robots of `configs/robots`, by name, and those of a user's own files, by path."""

import os
import platform
from dataclasses import replace
from pathlib import Path

from robojackson.errors import BadConfiguration, UnknownName
from robojackson.pipeline.yaml_loader import SUFFIXES, load, names
from robojackson.robot.description import RobotDescription

FOLDER = "robots"
MODELS = (".xml", ".mjcf", ".urdf")
"""Suffixes of what a description names, and is not."""


def robot_names() -> tuple[str, ...]:
    """Return the names of all robots."""
    return names(FOLDER)


def is_file(robot: str) -> bool:
    """Whether a robot is given by the path of its file: it has a separator or a file's suffix."""
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
    return replace(found, file="")


def read_description(file: Path) -> RobotDescription:
    """Return the description of a robot in a YAML file anywhere; its model is found from anywhere.

    Raises:
        UnknownName: there is no such file on this machine.
        BadConfiguration: a wrong key or value, or no YAML.
    """
    path = Path(os.path.abspath(file.expanduser()))
    if not path.is_file():
        raise UnknownName(
            "robot", str(file), f"no file {path} on {platform.node()}", robot_names()
        )
    if path.suffix.lower() not in SUFFIXES:
        raise BadConfiguration(
            f"{file}: a robot is described by a .yaml file; of an MJCF, "
            f"`robojackson robots new {file}` writes a first one"
        )
    found = load(RobotDescription, path)
    return replace(found, file=str(path), mjcf=_from_anywhere(found.mjcf, path.parent))


def _from_anywhere(mjcf: str, folder: Path) -> str:
    """The model of a file: beside the file where it is there, else from the working directory."""
    package, colon, _ = mjcf.partition(":")
    if colon and len(package) > 1:
        return mjcf
    given = Path(mjcf).expanduser()
    return os.path.abspath(folder / given if (folder / given).is_file() else given)
