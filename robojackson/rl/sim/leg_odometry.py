"""Place and velocity of a robot's root from what it measures: joints, attitude, gyroscope and
accelerometer.

The soles that carry a robot are taken to move as the reference's: to rest, or to slide as it
slides. Their speed beside the root is that of the root. The accelerometer bridges what the soles
do not tell, such as a slip or a step: a speed that is far from the predicted one is heeded less.
A complementary filter of fixed gains; the measurements are those of M. Bloesch et al., State
Estimation for Legged Robots (RSS 2012), whose filter weights them by covariances.

World frame, metres, radians, seconds. The floor is at z = 0.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from robojackson.geometry.rotations import quat_to_matrix
from robojackson.rl.sim.accelerometer import swing_velocity
from robojackson.rl.sim.reference_clip import ClipStep
from robojackson.robot.model import Robot
from robojackson.robot.tree_kinematics import above, point_jacobian, pose, tree

LOW_M = 0.004
"""Height above the lowest sole point that reduces a point's weight by a factor of e, metres."""
NEAR_M = 0.03
"""Height of the reference's sole points above which their speed is that of a swing, metres."""
SHARE = 0.3
"""Of the difference from a measured speed or height that is corrected in a control step."""
DOUBT_M_S, DOUBT_M = 0.05, 0.02
"""Differences at which only half of that is corrected."""

CONSTANTS = {
    "low": LOW_M,
    "near": NEAR_M,
    "share": SHARE,
    "doubt_speed": DOUBT_M_S,
    "doubt_height": DOUBT_M,
}
"""The same for other programs: deploy packs and live pages."""


@dataclass(frozen=True)
class RootState:
    """Estimates of N roots, and the velocity of the accelerometer beside each."""

    place: Float[np.ndarray, "N 3"]
    velocity: Float[np.ndarray, "N 3"]
    imu_velocity: Float[np.ndarray, "N 3"]


class LegOdometry:
    """Estimates of N robots, which begin at the place of their reference.

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
        step: ClipStep,
        begins: Bool[np.ndarray, " N"] | None = None,
    ) -> tuple[Float[np.ndarray, "N nq"], Float[np.ndarray, "N nv"]]:
        """Return the measured states with the estimates as place and velocity of the root.

        Args:
            qpos, qvel: What is measured; place and velocity of the root are not read.
            force: Specific force at the accelerometer, frame of the root, m/s^2; not read at the
                beginning.
            step: The next step of the reference.
            begins: Robots that begin here; None for those that have no memory yet.

        Raises:
            ValueError: no force, for a robot that has begun before.
        """
        qpos, qvel = qpos.copy(), qvel.copy()
        qpos[:, :3] = qvel[:, :3] = 0.0
        n = len(qpos)
        places, moves = self._soles.at(
            np.concatenate([qpos, step.qpos]), np.concatenate([qvel, step.qvel])
        )
        points, speeds, there, sliding = places[:n], moves[:n], places[n:], moves[n:]
        sliding = np.where(there[:, :, 2:] < NEAR_M, sliding, 0.0) * (1.0, 1.0, 0.0)
        lowest = points[:, :, 2].min(1)
        carried = np.exp(-(points[:, :, 2] - lowest[:, None]) / LOW_M)
        carried /= carried.sum(1, keepdims=True)
        measured = np.einsum("nc,nci->ni", carried, sliding - speeds)
        swing = swing_velocity(qpos, qvel, self._imu)
        place = step.qpos[:, :3] - self._dt * step.qvel[:, :3]
        velocity = _corrected(step.qvel[:, :3], measured, 1.0, DOUBT_M_S)
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
        place[:, 2:] = _corrected(place[:, 2:], -lowest[:, None], SHARE, DOUBT_M)
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
    """The lowest points of a robot's contact balls on a level floor."""

    def __init__(self, robot: Robot) -> None:
        self._tree, self._bodies = tree(robot), robot.contact_bodies
        self._radii, self._legs = robot.contact_radii, above(tree(robot), robot.contact_bodies)

    def at(
        self, qpos: Float[np.ndarray, "N nq"], qvel: Float[np.ndarray, "N nv"]
    ) -> tuple[Float[np.ndarray, "N C 3"], Float[np.ndarray, "N C 3"]]:
        """Return their positions, and the velocities of the balls."""
        posed = pose(self._tree, qpos, self._legs)
        jacobian = point_jacobian(self._tree, posed, posed.ball_pos, self._bodies)
        points = posed.ball_pos.copy()
        points[:, :, 2] -= self._radii
        return points, np.einsum("ncij,nj->nci", jacobian, qvel)
