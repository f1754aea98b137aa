"""A policy file of ours as a tracker: trained on many motions, it sees the reference ahead."""

from copy import copy
from pathlib import Path

import numpy as np
from jaxtyping import Float

from robojackson.errors import BadPolicy
from robojackson.rl.config.train_config import ControlConfig
from robojackson.rl.modes.observation import AHEAD, Observer
from robojackson.rl.policy import Policy, load_policy
from robojackson.rl.policy_facts import fact, observation_of, policy_control
from robojackson.rl.sim.motors import Motors, residual_scale
from robojackson.rl.trackers.equipment import require_robot
from robojackson.rl.trackers.tracker import Follower, TrackerInput
from robojackson.rl.trackers.tracker_description import TrackerDescription
from robojackson.robot.model import Robot


class PolicyTracker:
    """A policy that was trained with `track.observation: preview` or `full_preview` (`Tracker`
    protocol).

    Raises:
        BadPolicy: the file is damaged, or its policy does not see the reference ahead, or was
            trained on top of feedback, which a network that follows any motion does not have.
    """

    def __init__(self, description: TrackerDescription, path: Path) -> None:
        self.description, self.policy = description, load_policy(path)
        if observation_of(self.policy) not in AHEAD:
            raise BadPolicy(f"{path}: a policy of one motion: it does not see the reference ahead")
        self.window: tuple[int, ...] = (1,)
        self.control = fact(self.policy, "control", ControlConfig)
        if self.control.feedback:
            raise BadPolicy(
                f"{path}: trained on top of feedback, which this tracker does not have: train it "
                "with --set track.control.feedback=0"
            )
        self.sees_ahead, self.sees_travel = True, False

    def equip(self, robot: Robot) -> Robot:
        """Return the robot; a policy of ours was trained with its gains."""
        require_robot(robot, self.description)
        policy_control(self.policy, robot)
        return robot

    def follow(self, robot: Robot, n: int) -> Follower:
        """Return a follower of n robots."""
        require_robot(robot, self.description)
        return _PolicyFollower(self.policy, robot, n)


class Actor:
    """A policy on top of the targets of N robots, with the last action of each."""

    def __init__(self, policy: Policy, robot: Robot, n: int) -> None:
        self._policy, self._observer = policy, Observer(robot, observation_of(policy))
        self._scale = residual_scale(robot, policy_control(policy, robot))
        self._action: Float[np.ndarray, "N nu"] = np.zeros((n, robot.model.nu))

    def offsets(self, seen: TrackerInput) -> Float[np.ndarray, "N nu"]:
        """Return offsets of the targets of the PD law, rad, in actuator order."""
        step = seen.window[-1]
        observed = self._observer.observe(seen.qpos, seen.qvel, seen.points, step, self._action)
        self._action = self._policy.act(observed[:, : self._observer.actor_size])
        offsets: np.ndarray = self._scale * self._action
        return offsets


class _PolicyFollower:
    """N robots and what the policy did with each last."""

    def __init__(self, policy: Policy, robot: Robot, n: int) -> None:
        self._actor, self._hinge = Actor(policy, robot, n), Motors.of(robot.model).hinge

    def __copy__(self) -> "_PolicyFollower":
        """Return the same robots with a past of their own from now on."""
        twin = object.__new__(type(self))
        twin._actor, twin._hinge = copy(self._actor), self._hinge
        return twin

    def targets(self, seen: TrackerInput) -> Float[np.ndarray, "N nu"]:
        """Return target hinge angles of the PD law, rad, in actuator order."""
        targets: np.ndarray = seen.window[-1].angles(self._hinge) + self._actor.offsets(seen)
        return targets
