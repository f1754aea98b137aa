"""Retargeting: human motion to robot motion."""

from robojackson.retarget.motion import RetargetConfig, retarget
from robojackson.retarget.robot import Robot, RobotDescription, load_robot

__all__ = ["RetargetConfig", "Robot", "RobotDescription", "load_robot", "retarget"]
