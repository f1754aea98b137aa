"""The robots of `configs/robots`, by name, and those of a user's files."""

from pathlib import Path

from robojackson.errors import BadConfiguration
from robojackson.pipeline.yaml_loader import load, names
from robojackson.robot.description import RobotDescription

FOLDER = "robots"


def robot_names() -> tuple[str, ...]:
    """Return the names of all robots."""
    return names(FOLDER)


def describe_robot(name: str) -> RobotDescription:
    """Return the description of a robot.

    Raises:
        UnknownName: there is no such file; the message lists those that are.
        BadConfiguration: a wrong key or value, or another name in the file than that of the file:
            what is made for one robot would be taken for another's.
    """
    found = load(RobotDescription, f"{FOLDER}/{name}")
    if found.name != name:
        raise BadConfiguration(
            f"configs/{FOLDER}/{name}.yaml: name is {found.name!r}; it must be that of the file, "
            f"{name!r}"
        )
    return found


def read_description(file: Path) -> RobotDescription:
    """Return the description of a robot in a YAML file anywhere.

    Raises:
        UnknownName: there is no such file.
        BadConfiguration: a wrong key or value.
    """
    return load(RobotDescription, file)
