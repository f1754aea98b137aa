"""What a stage that loads a robot has in its cache key: the digest of the robot's model."""

from collections.abc import Mapping
from typing import Any

from robojackson.robot.model import load_robot


def robot_models(parameters: Mapping[str, Any]) -> list[str]:
    """Digest of the model of the parameter `robot`."""
    return [load_robot(parameters["robot"]).sha256]
