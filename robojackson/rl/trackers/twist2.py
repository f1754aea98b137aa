"""The tracker of TWIST2 (Ze et al., 2025): a network for the Unitree G1 at 50 Hz.

Observation, 1,432 numbers: the present frame (127), the ten frames before it, oldest first (1,270),
and the target again (35). A frame is the target and the robot's own measurements. Radians, metres,
seconds; roll and pitch are those of roll-pitch-yaw angles.

    target (35): of the reference's next step: root velocity x, y in the root's frame; root height;
        roll, pitch; yaw rate in the root's frame; joint angles
    frame (127): target; angular velocity in the root's frame * .25; roll, pitch; joint angles minus
        the default pose; joint speeds * .05, some of them zero; the last action

Action: clipped, scaled, added to the default pose. Upstream's deployment starts with an empty
history and its training with copies of the first frame; this one with copies.
"""

from pathlib import Path

import numpy as np
from jaxtyping import Float

from robojackson.geometry.rotations import quat_to_matrix
from robojackson.rl.config.train_config import ControlConfig
from robojackson.rl.sim.reference_clip import ClipStep
from robojackson.rl.trackers.equipment import Layout, equip, layout_of
from robojackson.rl.trackers.onnx_network import OnnxNetwork
from robojackson.rl.trackers.tracker import Follower, TrackerInput
from robojackson.rl.trackers.tracker_description import TrackerDescription
from robojackson.robot.model import Robot

GYRO_SCALE, SPEED_SCALE = 0.25, 0.05
"""Scales of angular velocities and of joint speeds in the observation."""
CONTROL = ControlConfig(feedforward=0.0, feedback=0.0)
"""The targets are the network's own: no lead is added."""
HISTORY = 10
"""Number of previous frames in the network's input."""


def observation_size(joints: int) -> int:
    """Return the length of the observation of a robot with `joints` joints."""
    target = 6 + joints
    return (HISTORY + 1) * (target + 5 + 3 * joints) + target


class Twist2Tracker:
    """TWIST2's network (`Tracker` protocol).

    Raises:
        MissingDependency: onnxruntime is not installed.
        BadPolicy: the file is damaged or of another network.
    """

    def __init__(self, description: TrackerDescription, path: Path) -> None:
        joints = len(description.joints)
        self.description = description
        self.window: tuple[int, ...] = (1,)
        self.control, self.sees_ahead, self.sees_travel = CONTROL, False, True
        self._network = OnnxNetwork(path, observation_size(joints), joints)

    def equip(self, robot: Robot) -> Robot:
        """Return the robot with the gains of the network's training."""
        return equip(robot, self.description)

    def follow(self, robot: Robot, n: int) -> Follower:
        """Return a follower of n robots, whose histories hold copies of the first frame."""
        layout = layout_of(robot, self.description)
        return _Twist2Follower(self.description, self._network, layout, n)


class _Twist2Follower:
    """N robots with the last frames and actions of each."""

    def __init__(
        self, description: TrackerDescription, network: OnnxNetwork, layout: Layout, n: int
    ) -> None:
        self._network, self._layout = network, layout
        self._scale, self._limit = description.action_scale, description.action_limit
        self._action = np.zeros((n, len(layout.order)))
        self._history: Float[np.ndarray, "N H F"] | None = None

    def targets(self, seen: TrackerInput) -> Float[np.ndarray, "N nu"]:
        """Return target hinge angles of the PD law, rad, in actuator order."""
        (step,) = seen.window
        target = target_of(step, self._layout)
        frame = frame_of(target, seen.qpos, seen.qvel, self._action, self._layout)
        if self._history is None:
            self._history = np.repeat(frame[:, None], HISTORY, axis=1)
        past = self._history.reshape(len(frame), -1)
        self._action = self._network(np.concatenate([frame, past, target], 1))
        self._history = np.concatenate([self._history[:, 1:], frame[:, None]], 1)
        moved = self._scale * np.clip(self._action, -self._limit, self._limit)
        angles: np.ndarray = self._layout.default + moved
        return angles[:, self._layout.motors]


def target_of(step: ClipStep, layout: Layout) -> Float[np.ndarray, "N 35"]:
    """Return the network's input for a step of the reference."""
    to_body = np.swapaxes(quat_to_matrix(step.qpos[:, 3:7]), 1, 2)
    velocity = np.einsum("nij,nj->ni", to_body, step.qvel[:, :3])
    parts = [velocity[:, :2], step.qpos[:, 2:3], _roll_pitch(to_body), step.qvel[:, 5:6]]
    return np.concatenate([*parts, step.qpos[:, 7:][:, layout.order]], 1)


def frame_of(
    target: Float[np.ndarray, "N 35"],
    qpos: Float[np.ndarray, "N nq"],
    qvel: Float[np.ndarray, "N nv"],
    action: Float[np.ndarray, "N J"],
    layout: Layout,
) -> Float[np.ndarray, "N 127"]:
    """Return the target and the robots' measurements.

    Args:
        action: The network's last output, unchanged.
    """
    to_body = np.swapaxes(quat_to_matrix(qpos[:, 3:7]), 1, 2)
    angles = qpos[:, 7:][:, layout.order] - layout.default
    speeds = np.where(layout.measured, qvel[:, 6:][:, layout.order], 0.0)
    measured = [GYRO_SCALE * qvel[:, 3:6], _roll_pitch(to_body), angles, SPEED_SCALE * speeds]
    return np.concatenate([target, *measured, action], 1)


def _roll_pitch(to_body: Float[np.ndarray, "N 3 3"]) -> Float[np.ndarray, "N 2"]:
    """Return roll and pitch from the up axis in the root's frame."""
    up = to_body[:, :, 2]
    pitch = np.arcsin(np.clip(-up[:, 0], -1.0, 1.0))
    return np.stack([np.arctan2(up[:, 1], up[:, 2]), pitch], 1)
