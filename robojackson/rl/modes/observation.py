"""Observation of a policy: the robot in its own frame, the next reference step, the difference.

Metres, radians, seconds, scaled by fixed constants to about one and clipped to +-10. Vectors are in
the frame of the root body, so a policy does not know its heading, except through the difference to
its reference.

`full` is everything that a simulation knows. `onboard` is the robot's own measurements: gyroscope,
attitude and joints (the inputs of mjlab's tracking task without state estimation): 9 + 5 numbers a
hinge, 154 on the Unitree G1. `preview` is these and the reference ahead (`sim.preview`), for
policies that follow more than one motion. In training, the rest follows for the critics alone,
without the sensors' noise (asymmetric actor and critic: Pinto et al., 2018); with `full_preview`
for the policy, too.
"""

from typing import Literal

import numpy as np
from jaxtyping import Float

from robojackson.geometry.rotations import quat_to_matrix
from robojackson.rl.sim.preview import preview_size
from robojackson.rl.sim.reference_clip import ClipStep
from robojackson.robot.model import Robot

SPEED_SCALE, HINGE_SPEED_SCALE, POINT_SCALE, ROOT_SCALE, CLIP = 0.3, 0.1, 2.0, 3.0, 10.0
USUAL_HEIGHT_M = 1.2
"""Height of the root that is observed as zero, for every robot: about that of Humanoid-v5's torso.

A robot of another size observes an offset, which the bias of the first layer takes up. A height of
its own would change the inputs of every saved policy.
"""
Kind = Literal["full", "onboard", "preview", "full_preview"]
"""Kinds of the policy's inputs."""
AHEAD: tuple[Kind, ...] = ("preview", "full_preview")
"""Those with the reference ahead."""


class Observer:
    """Builds the observation of N robots.

    Attributes:
        size: Length of the observation in training.
        actor_size: Length of the policy's part of it, at its beginning.
    """

    def __init__(self, robot: Robot, kind: Kind) -> None:
        hinges, motors = robot.model.nq - 7, robot.model.nu
        self._kind, self._rest = kind, robot.standing[7:]
        points = 3 * len(robot.keypoint_names)
        self.size = self.actor_size = 24 + 4 * hinges + motors + points
        if kind != "full":
            self.actor_size = 9 + 4 * hinges + motors
            if kind in AHEAD:
                self.actor_size += preview_size(hinges)
            self.size = self.actor_size + 15 + points
            if kind == "full_preview":
                self.actor_size = self.size

    def observe(
        self,
        qpos: Float[np.ndarray, "N nq"],
        qvel: Float[np.ndarray, "N nv"],
        points: Float[np.ndarray, "N K 3"],
        target: ClipStep,
        last_action: Float[np.ndarray, "N nu"],
        exact: tuple[Float[np.ndarray, "N nq"], Float[np.ndarray, "N nv"]] | None = None,
    ) -> Float[np.ndarray, "N D"]:
        """Return the observation of N robots whose next reference step is `target`, float32.

        Args:
            qpos, qvel: State as the sensors measure it.
            points: Keypoint sites, world, m.
            last_action: Last action, -1..1.
            exact: State without the sensors' noise, for what critics alone see; None: as measured.
        """
        turned, target_turn = quat_to_matrix(np.stack([qpos[:, 3:7], target.qpos[:, 3:7]]))
        to_body = np.swapaxes(turned, 1, 2)
        turn = to_body @ target_turn
        gyro, speeds = qvel[:, 3:6] * SPEED_SCALE, qvel[:, 6:] * HINGE_SPEED_SCALE
        attitude = [turn[:, :, 0], turn[:, :, 1]]
        aimed = target.qvel[:, 6:] * HINGE_SPEED_SCALE
        done = last_action * 0.5
        known = (qpos, qvel, to_body)
        if exact is not None and self.actor_size < self.size:
            known = (*exact, np.swapaxes(quat_to_matrix(exact[0][:, 3:7]), 1, 2))
        height, gravity, velocity, phase, offset, travel, apart = _of_root(*known, points, target)
        if self._kind == "full":
            parts = [
                height, gravity, velocity, gyro, qpos[:, 7:], speeds, phase, offset, *attitude,
                target.qpos[:, 7:] - qpos[:, 7:], aimed, travel, apart, done,
            ]  # fmt: skip
        else:
            ahead = [] if target.preview is None else [target.preview]
            parts = [
                gyro, *attitude, qpos[:, 7:] - self._rest, speeds,
                target.qpos[:, 7:] - self._rest, aimed, done, *ahead,
                height, gravity, velocity, phase, offset, travel, apart,
            ]  # fmt: skip
        result: np.ndarray = np.clip(np.concatenate(parts, 1), -CLIP, CLIP).astype(np.float32)
        return result


def _of_root(
    qpos: Float[np.ndarray, "N nq"],
    qvel: Float[np.ndarray, "N nv"],
    to_body: Float[np.ndarray, "N 3 3"],
    points: Float[np.ndarray, "N K 3"],
    target: ClipStep,
) -> list[Float[np.ndarray, "N D"]]:
    """Return height, gravity, velocity, phase, offset and travel of the root, and where the
    keypoints belong."""

    def local(vector: np.ndarray) -> np.ndarray:
        found: np.ndarray = np.einsum("nij,nj->ni", to_body, vector)
        return found

    angle = 2 * np.pi * target.phase
    away = (target.points - points) @ np.swapaxes(to_body, 1, 2)
    return [
        qpos[:, 2:3] - USUAL_HEIGHT_M,
        to_body[:, :, 2],
        local(qvel[:, :3]),
        np.stack([np.sin(angle), np.cos(angle)], 1),
        local(target.qpos[:, :3] - qpos[:, :3]) * ROOT_SCALE,
        local(target.qvel[:, :3]),
        away.reshape(len(qpos), -1) * POINT_SCALE,
    ]
