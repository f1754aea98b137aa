"""The linear-quadratic feedback along a reference as a tracker: it needs no network and no file.

A motion that the feedback along it does not hold is first simulated many times, for a path beside
it that the physics follows (`docs/learning_g1.md`, "A sampled path"). It works on any robot whose
contacts the physics knows; jumps need a policy.
"""

from pathlib import Path

import numpy as np
from jaxtyping import Float

from robojackson.rl.config.train_config import ControlConfig
from robojackson.rl.sim.motors import Motors
from robojackson.rl.trackers.equipment import require_robot
from robojackson.rl.trackers.leg_odometry import LegOdometry
from robojackson.rl.trackers.tracker import Follower, TrackerInput
from robojackson.rl.trackers.tracker_description import TrackerDescription
from robojackson.robot.model import Robot


class RegulatorTracker:
    """Feedback along the reference alone (`Tracker` protocol)."""

    def __init__(self, description: TrackerDescription, path: Path | None = None) -> None:
        self.description = description
        self.window: tuple[int, ...] = (1,)
        self.control = ControlConfig(feedforward=1.0, feedback=1.0, feedback_path="sampled")
        self.sees_ahead = self.sees_travel = False

    def equip(self, robot: Robot) -> Robot:
        """Return the robot, whose own gains the feedback uses."""
        require_robot(robot, self.description)
        return robot

    def follow(self, robot: Robot, n: int) -> Follower:
        """Return a follower of n robots."""
        require_robot(robot, self.description)
        estimated = self.description.root_state == "estimated"
        odometry = LegOdometry(robot, self.description.control_dt) if estimated else None
        return _RegulatorFollower(robot, odometry)


class _RegulatorFollower:
    """N robots; the feedback has no memory, the odometry has."""

    def __init__(self, robot: Robot, odometry: LegOdometry | None) -> None:
        self._hinge, self._odometry = Motors.of(robot.model).hinge, odometry

    def targets(self, seen: TrackerInput) -> Float[np.ndarray, "N nu"]:
        """Return target hinge angles of the PD law, rad, in actuator order."""
        (step,) = seen.window
        targets = step.angles(self._hinge)
        if step.feedback is not None:
            state = (seen.qpos, seen.qvel)
            if self._odometry is not None:
                state = self._odometry.estimate(seen)
            targets = targets + step.feedback(*state)
        return targets
