"""Place and velocity of a robot's root from what it measures: joints, attitude, gyroscope and
accelerometer.

The soles that carry a robot are taken to move as on the path that its feedback keeps it on, which
was simulated: they rest, roll, slide and sink into the floor as there. Their speed beside the root
is that of the root, and their depth gives its height. The accelerometer bridges what the soles do
not tell, such as a slip or a step: a speed that is far from the predicted one is heeded less.
A complementary filter of fixed gains; the measurements are those of M. Bloesch et al., State
Estimation for Legged Robots (RSS 2012), whose filter weights them by covariances.

World frame, metres, radians, seconds.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from robojackson.geometry.rotations import quat_to_matrix
from robojackson.rl.sim.accelerometer import swing_velocity
from robojackson.robot.model import Robot
from robojackson.robot.tree_kinematics import above, point_jacobian, pose, tree

LOW_M = 0.004
"""Height above the lowest sole point that reduces a point's weight by a factor of e, metres."""
SHARE = 0.3
"""Of the difference from a measured speed that is corrected in a control step."""
DOUBT_M_S = 0.05
"""Difference at which only half of that is corrected."""

CONSTANTS = {"low": LOW_M, "share": SHARE, "doubt_speed": DOUBT_M_S}
"""The same for other programs: deploy packs and live pages."""


@dataclass(frozen=True)
class RootState:
    """Estimates of N roots, and the velocity of the accelerometer beside each."""

    place: Float[np.ndarray, "N 3"]
    velocity: Float[np.ndarray, "N 3"]
    imu_velocity: Float[np.ndarray, "N 3"]


class LegOdometry:
    """Estimates of N robots, which begin at the place of their path.

    The memory is replaced every step, never changed in place: a copy continues by itself.

    Attributes:
        now: The memory; None before the first estimate.
    """

    def __init__(self, robot: Robot, dt: float) -> None:
        self._soles, self._dt = _Soles(robot), dt
        self._gravity = np.array(robot.model.opt.gravity)
        self._imu = np.array(robot.description.imu)
        self.now: RootState | None = None

    def estimate(
        self,
        qpos: Float[np.ndarray, "N nq"],
        qvel: Float[np.ndarray, "N nv"],
        force: Float[np.ndarray, "N 3"] | None,
        path: tuple[Float[np.ndarray, "N nq"], Float[np.ndarray, "N nv"]],
        begins: Bool[np.ndarray, " N"] | None = None,
    ) -> tuple[Float[np.ndarray, "N nq"], Float[np.ndarray, "N nv"]]:
        """Return the measured states with the estimates as place and velocity of the root.

        Args:
            qpos, qvel: What is measured; place and velocity of the root are not read.
            force: Specific force at the accelerometer, frame of the root, m/s^2; not read at the
                beginning.
            path: States that the feedback keeps the robots in, now (`StepCorrection.path`).
            begins: Robots that begin here; None for those that have no memory yet.

        Raises:
            ValueError: no force, for a robot that has begun before.
        """
        qpos, qvel = qpos.copy(), qvel.copy()
        qpos[:, :3] = qvel[:, :3] = 0.0
        n = len(qpos)
        heights, moves = self._soles.at(
            np.concatenate([qpos, path[0]]), np.concatenate([qvel, path[1]])
        )
        lowest, aimed = heights[:n].min(1), heights[n:].min(1)
        carried = np.exp(-(heights[:n] - lowest[:, None]) / LOW_M)
        carried /= carried.sum(1, keepdims=True)
        measured = np.einsum("nc,nci->ni", carried, moves[n:] - moves[:n])
        swing = swing_velocity(qpos, qvel, self._imu)
        place = path[0][:, :3].copy()
        velocity = _corrected(path[1][:, :3], measured, 1.0, DOUBT_M_S)
        begun = np.zeros(len(qpos), bool) if self.now is None else np.ones(len(qpos), bool)
        if begins is not None:
            begun &= ~begins
        if self.now is not None and begun.any():
            if force is None:
                raise ValueError("leg odometry needs the accelerometer")
            turned = np.einsum("nij,nj->ni", quat_to_matrix(qpos[:, 3:7]), force)
            predicted = self.now.imu_velocity + self._dt * (turned + self._gravity) - swing
            later = _corrected(predicted, measured, SHARE, DOUBT_M_S)
            velocity = np.where(begun[:, None], later, velocity)
            place = np.where(begun[:, None], self.now.place + self._dt * later, place)
        place[:, 2] = aimed - lowest
        self.now = RootState(place, velocity, velocity + swing)
        qpos[:, :3], qvel[:, :3] = place, velocity
        return qpos, qvel


def _corrected(
    value: Float[np.ndarray, "N D"], measured: Float[np.ndarray, "N D"], share: float, doubt: float
) -> Float[np.ndarray, "N D"]:
    """Return values moved towards measured ones, by half of the share where these are `doubt`
    away."""
    apart = measured - value
    away = np.linalg.norm(apart, axis=1, keepdims=True)
    result: np.ndarray = value + share / (1 + (away / doubt) ** 2) * apart
    return result


class _Soles:
    """The lowest points of a robot's contact balls."""

    def __init__(self, robot: Robot) -> None:
        self._tree, self._bodies = tree(robot), robot.contact_bodies
        self._radii, self._legs = robot.contact_radii, above(tree(robot), robot.contact_bodies)

    def at(
        self, qpos: Float[np.ndarray, "N nq"], qvel: Float[np.ndarray, "N nv"]
    ) -> tuple[Float[np.ndarray, "N C"], Float[np.ndarray, "N C 3"]]:
        """Return their heights, and their velocities as parts of the soles."""
        posed = pose(self._tree, qpos, self._legs)
        points = posed.ball_pos.copy()
        points[:, :, 2] -= self._radii
        jacobian = point_jacobian(self._tree, posed, points, self._bodies)
        return points[:, :, 2], np.einsum("ncij,nj->nci", jacobian, qvel)
