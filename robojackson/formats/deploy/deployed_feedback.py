"""Contents of a deploy pack without a network: the feedback along a motion, and what it estimates.

World frame of the motion, metres, radians, seconds; hinges in the order of qpos.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from robojackson.formats.containers import npz_archive
from robojackson.formats.deploy.deployed_machine import DeployedMachine
from robojackson.robot.model import Robot
from robojackson.robot.tree_kinematics import tree


@dataclass(frozen=True)
class Ball:
    """A point of a robot's sole: the centre of a ball in the frame of its body, and its radius."""

    body: str
    centre: tuple[float, float, float]
    radius: float = 0.0

    def as_row(self) -> list[object]:
        """Return it as deploy.yaml holds it."""
        return [self.body, list(self.centre), self.radius]


def balls_of(
    robot: Robot,
    bodies: Int[np.ndarray, " C"],
    centres: Float[np.ndarray, "C 3"],
    radii: Float[np.ndarray, " C"],
) -> tuple[Ball, ...]:
    """Return points of bodies by the names of the bodies.

    Args:
        centres: In the frames of the bodies, m.
        radii: Metres.
    """
    names = [robot.model.body(int(body)).name for body in bodies]
    return tuple(
        Ball(name, (float(x), float(y), float(z)), float(radius))
        for name, (x, y, z), radius in zip(names, centres, radii, strict=True)
    )


def soles_of(robot: Robot) -> tuple[Ball, ...]:
    """Return the points that carry a robot."""
    own = tree(robot)
    return balls_of(robot, own.ball_body, own.ball_position, robot.contact_radii)


@dataclass(frozen=True)
class DeployedFeedback:
    """Feedback that uses only measurements of the robot itself, and the settings to run it.

    Attributes:
        machine: Robot and motion.
        targets: Targets that lead to each step, without feedback, rad.
        gain, offset: Moves of the targets from a step on: -(gain @ difference + offset), rad.
        limit: The largest of these moves, rad.
        path_qpos, path_qvel: States that the difference is from.
        places: Feet of these states, which are moved along the floor to the robot's own feet.
        soles: Points that carry the robot.
        feet: Points that `places` are of.
        imu: Place of the accelerometer in the frame of the root.
        odometry: Constants of the estimate by the names of `rl.sim.leg_odometry`.
    """

    machine: DeployedMachine
    targets: Float[np.ndarray, "S J"]
    gain: Float[np.ndarray, "S J X"]
    offset: Float[np.ndarray, "S J"]
    limit: Float[np.ndarray, " J"]
    path_qpos: Float[np.ndarray, "S nq"]
    path_qvel: Float[np.ndarray, "S nv"]
    places: Float[np.ndarray, "S F 3"]
    soles: tuple[Ball, ...]
    feet: tuple[Ball, ...]
    imu: tuple[float, float, float]
    odometry: dict[str, float]

    def archive(self) -> bytes:
        """Return the content of feedback.npz; gains in single precision."""
        reference = self.machine.reference
        rows = {name: getattr(self, name) for name in ("path_qpos", "path_qvel", "places")}
        rows |= {"targets": self.targets, "offset": self.offset}
        rows |= {"qpos": np.asarray(reference.qpos), "qvel": np.asarray(reference.qvel)}
        return npz_archive.pack({**rows, "gain": self.gain.astype(np.float32)})
