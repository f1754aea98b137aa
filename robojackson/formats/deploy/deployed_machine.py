"""The robot of a deploy pack and its motion, whatever drives it.

All arrays are in the order of the robot's hinges, which is that of qpos. Metres, radians, seconds,
newton-metres.
"""

from dataclasses import dataclass

import mujoco
import numpy as np
from jaxtyping import Float

from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.robot.mjcf import mjcf_path, read_spec
from robojackson.robot.model import Robot


@dataclass(frozen=True)
class DeployedMachine:
    """A robot with the limits and gains that a runner needs, and the motion that it dances.

    Attributes:
        model: The compiled robot.
        reference: The motion.
        root: Name of the body with the free joint.
        default: Angles of the default stand, rad; observations and actions are relative to them.
        stiffness, damping: Gains of the PD law, Nm/rad and Nm s/rad.
        torque_limit, speed_limit: Limits of every hinge, Nm and rad/s.
        fall_tilt: Angle between the up axes of robot and reference that counts as a fall, rad.
        places: Index of every hinge in the MJCF, in which welded hinges count, too.
    """

    model: mujoco.MjModel
    reference: ReferenceMotion
    root: str
    default: Float[np.ndarray, " J"]
    stiffness: Float[np.ndarray, " J"]
    damping: Float[np.ndarray, " J"]
    torque_limit: Float[np.ndarray, " J"]
    speed_limit: Float[np.ndarray, " J"]
    fall_tilt: float
    places: tuple[int, ...]

    @property
    def joints(self) -> tuple[str, ...]:
        """Return the names of the hinges."""
        return self.reference.joint_names


def places_in_mjcf(robot: Robot) -> tuple[int, ...]:
    """Return the index of every hinge among those of the MJCF, including the hinges that the
    description welds: the motors of a robot keep their numbers when one of them is missing."""
    spec = read_spec(mjcf_path(robot.description), robot.description)
    hinge = mujoco.mjtJoint.mjJNT_HINGE
    names = [joint.name for joint in spec.joints if joint.type == hinge]
    return tuple(names.index(name) for name in robot.joint_names)
