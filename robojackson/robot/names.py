"""Names in a robot description: every one is known, or the error lists those that are."""

import re
from collections.abc import Iterable
from fnmatch import fnmatchcase

from robojackson.errors import UnknownName
from robojackson.robot.description import RobotDescription

PELVIS, HIPS = "pelvis", ("left_hip", "right_hip")
FEET, HANDS = ("left_foot", "right_foot"), ("left_hand", "right_hand")
"""Keypoints that every robot has."""
LONGEST_NAME = 64
"""Characters of a robot's name."""


def where(description: RobotDescription, key: str) -> str:
    """Return the place in the configuration that an error message names."""
    return f"{description.file or f'configs/robots/{description.name}.yaml'}: {key}"


def known(kind: str, name: str, names: Iterable[str], place: str) -> str:
    """Return the name itself, or UnknownName."""
    names = list(names)
    if name not in names:
        raise UnknownName(kind, name, place, names)
    return name


def matching(kind: str, pattern: str, names: Iterable[str], place: str) -> list[str]:
    """Return the names that a pattern with `*` means, at least one, or UnknownName."""
    names = list(names)
    found = [name for name in names if fnmatchcase(name, pattern)]
    if not found:
        raise UnknownName(kind, pattern, place, names)
    return found


def robot_name(text: str) -> str:
    """Return a text as a name that a description may have."""
    return re.sub(r"[^\w.-]+", "_", text).strip("_.-")[:LONGEST_NAME] or "robot"
