"""State of a robot from its own measurements: a part of a deploy pack with feedback.

Place and velocity of the root follow from the soles that carry it, which rest or slide as the
motion's, and from the accelerometer. All in the frame of the motion; m, rad, s.
"""

from typing import Any

import mujoco
import numpy as np

Array = np.ndarray


class StateEstimator:
    """The estimate of one robot from the beginning of a dance on.

    Args:
        model: The robot.
        cfg: Content of deploy.yaml.
    """

    def __init__(self, model: mujoco.MjModel, cfg: dict[str, Any]) -> None:
        self.model, self.cfg, self.pose = model, cfg, mujoco.MjData(model)
        self.rule, self.dt = cfg["odometry"], cfg["step_dt"]
        self.imu_velocity: Array | None = None
        self.place = np.zeros(3)

    def estimate(
        self, ahead: dict[str, Array], qpos: Array, qvel: Array, force: Array
    ) -> tuple[Array, Array]:
        """Return position and velocity with estimates of the root's.

        Args:
            ahead: The motion one step ahead.
            qpos, qvel: Measured; place and velocity of the root are not read.
            force: The accelerometer, axes of the root.
        """
        rule, axes, low = self.rule, matrix(qpos[3:7]), self.rule["low"]
        qpos[:3] = qvel[:3] = 0.0
        swing = axes @ np.cross(qvel[3:6], self.cfg["imu"])
        aimed, sliding, _ = self.points("soles", ahead["qpos"], ahead["qvel"], low)
        sliding = np.where(aimed[:, 2:] < rule["near"], sliding, 0.0) * [1, 1, 0]
        soles, speeds, shares = self.points("soles", qpos, qvel, low)
        speed, felt = shares @ (sliding - speeds), ahead["qvel"][:3]
        if self.imu_velocity is None:
            velocity = corrected(felt, speed, 1.0, rule["doubt_speed"])
            self.place = ahead["qpos"][:3] - self.dt * felt
        else:
            felt = self.imu_velocity + self.dt * (axes @ force + self.model.opt.gravity) - swing
            velocity = corrected(felt, speed, rule["share"], rule["doubt_speed"])
            self.place = self.place + self.dt * velocity
        high = corrected(self.place[2:], -soles[:, 2].min(), rule["share"], rule["doubt_height"])
        self.place[2:], self.imu_velocity = high, velocity + swing
        qpos[:3], qvel[:3] = self.place, velocity
        return qpos, qvel

    def points(self, name: str, qpos: Array, qvel: Array, low: float) -> tuple[Array, Array, Array]:
        """Return the lowest points of balls, their speeds, and how much each of them carries.

        Args:
            name: `soles` or `feet` of deploy.yaml.
            low: Height above the lowest that makes a point carry e times less, m.
        """
        self.pose.qpos[:], jacobian, found = qpos, np.zeros((3, self.model.nv)), []
        mujoco.mj_kinematics(self.model, self.pose)
        mujoco.mj_comPos(self.model, self.pose)
        for owner, place, radius in self.cfg[name]:
            body = self.pose.body(owner)
            centre = body.xpos + body.xmat.reshape(3, 3) @ place
            mujoco.mj_jac(self.model, self.pose, jacobian, None, centre, body.id)
            found.append((centre - [0, 0, radius], jacobian @ qvel))
        points, speeds = np.array(found).swapaxes(0, 1)
        shares = np.exp(-(points[:, 2] - points[:, 2].min()) / low)
        return points, speeds, shares / shares.sum()


def matrix(quat: Array) -> Array:
    """Return the rotation matrix."""
    turn = np.zeros(9)
    mujoco.mju_quat2Mat(turn, quat)
    return np.asarray(turn.reshape(3, 3))


def corrected(value: Array, measured: Array, share: float, doubt: float) -> Array:
    """Return a value moved to a measured one, by half of the share where that is `doubt` away."""
    apart = measured - value
    return np.asarray(value + share / (1 + (np.linalg.norm(apart) / doubt) ** 2) * apart)
