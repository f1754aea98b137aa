"""The linear-quadratic feedback along a reference as a tracker: it needs no network and no file.

A motion that the feedback along it does not hold is first simulated many times, for a path beside
it that the physics follows (`docs/learning_g1.md`, "A sampled path"). It works on any robot whose
contacts the physics knows; jumps need a policy.
"""

from pathlib import Path

import numpy as np
from jaxtyping import Float

from robojackson.rl.config.train_config import ControlConfig
from robojackson.rl.sim.leg_odometry import LegOdometry
from robojackson.rl.sim.motors import Motors
from robojackson.rl.sim.step_law import StepCorrection
from robojackson.rl.trackers.equipment import require_robot
from robojackson.rl.trackers.tracker import Follower, TrackerInput
from robojackson.rl.trackers.tracker_description import TrackerDescription
from robojackson.robot.model import Robot


class RegulatorTracker:
    """Feedback along the reference alone (`Tracker` protocol)."""

    def __init__(self, description: TrackerDescription, path: Path | None = None) -> None:
        self.description = description
        self._estimated = description.root_state == "estimated"
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
        kind = _EstimatingFollower if self._estimated else _RegulatorFollower
        return kind(robot, self.description.control_dt)


class _RegulatorFollower:
    """N robots; the feedback has no memory."""

    def __init__(self, robot: Robot, dt: float) -> None:
        self._hinge = Motors.of(robot.model).hinge

    def targets(self, seen: TrackerInput) -> Float[np.ndarray, "N nu"]:
        """Return target hinge angles of the PD law, rad, in actuator order."""
        step = seen.window[-1]
        targets = step.angles(self._hinge)
        if step.feedback is not None:
            targets = targets + self.correction(seen, step.feedback)
        return targets

    def correction(self, seen: TrackerInput, feedback: StepCorrection) -> np.ndarray:
        """Return the offsets of the targets by the feedback of a step, rad."""
        return feedback(seen.qpos, seen.qvel)


class _EstimatingFollower(_RegulatorFollower):
    """N robots and the odometry of each.

    Where a robot is on the floor it cannot know for long: the feedback is from where its own feet
    stand beside those of the reference.
    """

    def __init__(self, robot: Robot, dt: float) -> None:
        super().__init__(robot, dt)
        self._odometry = LegOdometry(robot, dt)

    def correction(self, seen: TrackerInput, feedback: StepCorrection) -> np.ndarray:
        """Return the offsets by what is measured and, of the root, estimated, rad."""
        state = self._odometry.estimate(seen.qpos, seen.qvel, seen.force, seen.window[-1])
        return feedback(*state, beside_feet=True)
