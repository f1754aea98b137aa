"""Robots: a description bound to its MuJoCo model."""

from robojackson.api.arguments import RobotLike, path_of
from robojackson.pipeline.robot_descriptions import describe_robot
from robojackson.robot.description import RobotDescription
from robojackson.robot.model import Robot
from robojackson.robot.model import load_robot as bind_robot


def load_robot(robot: RobotLike = "humanoid") -> Robot:
    """Load and check a robot.

    Args:
        robot: Name (`humanoid`, `g1`, or a file of the user's `configs/robots`), the YAML file of
            a description, a description, or a robot, which is returned as it is.

    Returns:
        The MuJoCo model with the keypoint sites, and what every name is bound to.

    Raises:
        UnknownName: no such robot, body, joint or site; the message lists the known ones.
        BadConfiguration: a wrong key or value, or a model that MuJoCo cannot load.
        MissingDependency: the model has to be fetched first (`robojackson robots add NAME`).
    """
    if isinstance(robot, Robot):
        return robot
    if isinstance(robot, RobotDescription):
        return bind_robot(robot)
    return bind_robot(describe_robot(str(path_of(robot, "the robot", ", a name or a robot"))))
