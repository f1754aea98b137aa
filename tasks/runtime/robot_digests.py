"""Robots in stages: what is in the cache key of one that loads a robot; what its process reads."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml

from robojackson.files.json_types import to_json_types
from robojackson.robot.description import RobotDescription
from robojackson.robot.model import load_robot


def robot_models(parameters: Mapping[str, Any]) -> list[str]:
    """Return the digest of the model of the parameter `robot`."""
    return [load_robot(parameters["robot"]).sha256]


def robot_file(robot: RobotDescription, work: Path) -> Path:
    """Write the description of a robot for a process, in its own order; return its path.

    The order of its contacts is that of a reference motion's columns.

    The motion that the process reads does not name its description's place, as it may have been
    made on another machine.
    """
    path = work.absolute() / "robot.yaml"
    path.write_text(yaml.safe_dump(to_json_types(robot), sort_keys=False))
    return path
