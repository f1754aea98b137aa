"""Interface of a tracker: a policy for one robot that follows any reference motion.

A tracker has no state. `follow` begins with a number of robots, all at once; its result stores
their past (the last actions, a history of observations) for the length of a dance.
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
    """Input of N robots before a control step.

    Attributes:
        qpos, qvel: State, as the sensors measure it.
        points: Keypoint sites, world, m.
        window: The reference at the steps ahead that the tracker requests (`Tracker.window`).
        force: Specific force that the accelerometer at the root shows, mean over the last control
            step, frame of the root, m/s^2; None in a performance.
    """

    qpos: Float[np.ndarray, "N nq"]
    qvel: Float[np.ndarray, "N nv"]
    points: Float[np.ndarray, "N K 3"]
    window: tuple[ClipStep, ...]
    force: Float[np.ndarray, "N 3"] | None = None


class Follower(Protocol):
    """N robots that follow; stores the past that the network needs. A `copy.copy` of it goes on by
    itself: a performance looks ahead with one."""

    def targets(self, seen: TrackerInput) -> Float[np.ndarray, "N nu"]:
        """Return target hinge angles of the PD law, rad, in actuator order; once a control step."""


class Tracker(Protocol):
    """A network with the layout of its inputs and outputs.

    Attributes:
        description: Description of the network.
        window: Steps of the reference in its input, relative to the present one; 1 is the next.
        control: The control law that follows its targets.
        sees_ahead: Whether a step of the window carries a preview (`sim.preview`).
        sees_travel: Whether it sees how fast the reference's root travels.
    """

    description: TrackerDescription
    window: tuple[int, ...]
    control: ControlConfig
    sees_ahead: bool
    sees_travel: bool

    def equip(self, robot: Robot) -> Robot:
        """Return the robot with the gains of the network's training.

        Raises:
            BadPolicy: the tracker is for another robot.
        """

    def follow(self, robot: Robot, n: int) -> Follower:
        """Return a follower of n robots.

        Raises:
            BadPolicy: the tracker is for another robot.
        """
