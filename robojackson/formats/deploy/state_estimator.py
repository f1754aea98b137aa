"""State of a robot from its own measurements: a part of a deploy pack with feedback.

Place and velocity of the root follow from the soles that carry it, which rest, roll, slide and sink
as on the path of the feedback, and from the accelerometer. In the frame of the motion; m, rad, s.
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
        self, now: dict[str, Array], qpos: Array, qvel: Array, force: Array
    ) -> tuple[Array, Array]:
        """Return position and velocity with estimates of the root's.

        Args:
            now: The motion and its path now.
            qpos, qvel: Measured; place and velocity of the root are not read.
            force: The accelerometer, axes of the root.
        """
        rule, axes, low = self.rule, matrix(qpos[3:7]), self.rule["low"]
        qpos[:3] = qvel[:3] = 0.0
        swing = axes @ np.cross(qvel[3:6], self.cfg["imu"])
        aimed, moves, _ = self.points("soles", now["path_qpos"], now["path_qvel"], low)
        soles, speeds, shares = self.points("soles", qpos, qvel, low)
        speed, felt = shares @ (moves - speeds), now["path_qvel"][:3]
        if self.imu_velocity is None:
            velocity = corrected(felt, speed, 1.0, rule["doubt_speed"])
            self.place = now["path_qpos"][:3].copy()
        else:
            felt = self.imu_velocity + self.dt * (axes @ force + self.model.opt.gravity) - swing
            velocity = corrected(felt, speed, rule["share"], rule["doubt_speed"])
            self.place = self.place + self.dt * velocity
        self.place[2] = aimed[:, 2].min() - soles[:, 2].min()
        self.imu_velocity = velocity + swing
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
            lowest = body.xpos + body.xmat.reshape(3, 3) @ place - [0, 0, radius]
            mujoco.mj_jac(self.model, self.pose, jacobian, None, lowest, body.id)
            found.append((lowest, jacobian @ qvel))
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
