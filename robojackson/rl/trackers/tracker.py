"""What a tracker is: a policy for one robot that follows any reference motion.

A tracker keeps no state. `follow` begins with a number of robots, all at once, and what it returns
remembers their past (the last actions, a history of observations) until they have danced.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from jaxtyping import Float

from robojackson.rl.config.train_config import ControlConfig
from robojackson.rl.sim.reference_clip import ClipStep
from robojackson.rl.trackers.tracker_description import TrackerDescription
from robojackson.robot.model import Robot


@dataclass(frozen=True)
class TrackerInput:
    """What N robots see before a control step.

    Attributes:
        qpos, qvel: State, as the sensors measure it.
        points: Keypoint sites, world, m.
        window: The reference at the steps ahead that the tracker requests (`Tracker.window`).
    """

    qpos: Float[np.ndarray, "N nq"]
    qvel: Float[np.ndarray, "N nv"]
    points: Float[np.ndarray, "N K 3"]
    window: tuple[ClipStep, ...]


class Follower(Protocol):
    """N robots that follow; remembers what the network needs of their past."""

    def targets(self, seen: TrackerInput) -> Float[np.ndarray, "N nu"]:
        """Return target hinge angles of the PD law, rad, in actuator order; once a control step."""


class Tracker(Protocol):
    """A network with the layout of its inputs and outputs.

    Attributes:
        description: What is known of it.
        window: Steps of the reference that it sees, counted from the present one; 1 is the next.
        control: The law of control that follows its targets.
        sees_ahead: Whether a step of the window carries a preview (`sim.preview`).
    """

    description: TrackerDescription
    window: tuple[int, ...]
    control: ControlConfig
    sees_ahead: bool

    def equip(self, robot: Robot) -> Robot:
        """Return the robot with the gains that the network was trained with.

        Raises:
            BadPolicy: the tracker is for another robot.
        """

    def follow(self, robot: Robot, n: int) -> Follower:
        """Begin with n robots.

        Raises:
            BadPolicy: the tracker is for another robot.
        """
