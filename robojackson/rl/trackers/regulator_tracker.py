"""The linear-quadratic feedback along a reference as a tracker: it needs no network and no file.
It may have a network on top, a policy that was trained on many motions.

A motion that the feedback along it does not hold is first simulated many times, for a path beside
it that the physics follows (`docs/learning_g1.md`, "A sampled path"). It works on any robot whose
contacts the physics knows; jumps need a policy.
"""

from pathlib import Path

import numpy as np
from jaxtyping import Float

from robojackson.errors import BadPolicy
from robojackson.rl.config.train_config import ControlConfig
from robojackson.rl.policy import Policy, load_policy
from robojackson.rl.policy_facts import observation_of, policy_control, recorded_law
from robojackson.rl.sim.leg_odometry import LegOdometry
from robojackson.rl.sim.motors import Motors
from robojackson.rl.sim.step_law import StepCorrection
from robojackson.rl.trackers.equipment import require_robot
from robojackson.rl.trackers.policy_tracker import Actor
from robojackson.rl.trackers.tracker import Follower, TrackerInput
from robojackson.rl.trackers.tracker_description import TrackerDescription
from robojackson.robot.model import Robot


class RegulatorTracker:
    """Feedback along the reference, alone or with a network on top (`Tracker` protocol).

    Args:
        description: Its `root_state` says what the feedback is from.
        path: Policy that was trained on top of feedback from the robot's own measurements, on many
            motions; None for the feedback alone.

    Attributes:
        policy: That policy.

    Raises:
        BadPolicy: the file is none of ours, or a policy without feedback or of the full state.
    """

    def __init__(self, description: TrackerDescription, path: Path | None = None) -> None:
        self.description = description
        self._estimated = description.root_state == "estimated"
        self.policy = None if path is None else load_policy(path)
        if self.policy is not None and not (self._estimated and _is_onboard(self.policy)):
            raise BadPolicy(
                f"{path}: not a policy of a robot's own measurements on top of feedback: train it "
                "with --set track.observation=onboard, and set root_state: estimated"
            )
        self.window: tuple[int, ...] = (1,)
        self.control = ControlConfig(feedforward=1.0, feedback=1.0, feedback_path="sampled")
        self.sees_ahead = self.sees_travel = False

    def equip(self, robot: Robot) -> Robot:
        """Return the robot, whose own gains the feedback uses."""
        require_robot(robot, self.description)
        if self.policy is not None:
            policy_control(self.policy, robot)
        return robot

    def follow(self, robot: Robot, n: int) -> Follower:
        """Return a follower of n robots."""
        require_robot(robot, self.description)
        dt = self.description.control_dt
        if self.policy is not None:
            return _LearntFollower(robot, dt, self.policy, n)
        return (_EstimatingFollower if self._estimated else _RegulatorFollower)(robot, dt)


def _is_onboard(policy: Policy) -> bool:
    """Return whether a policy sees what a robot measures and moves the targets of feedback."""
    return observation_of(policy) == "onboard" and bool(recorded_law(policy).get("feedback"))


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
        state = self._odometry.estimate(seen.qpos, seen.qvel, seen.force, feedback.path())
        return feedback(*state, beside_feet=True)


class _LearntFollower(_EstimatingFollower):
    """N robots with a policy on top of the feedback."""

    def __init__(self, robot: Robot, dt: float, policy: Policy, n: int) -> None:
        super().__init__(robot, dt)
        self._actor = Actor(policy, robot, n)

    def targets(self, seen: TrackerInput) -> Float[np.ndarray, "N nu"]:
        """Return target hinge angles of the PD law, rad, in actuator order."""
        targets: np.ndarray = super().targets(seen) + self._actor.offsets(seen)
        return targets
