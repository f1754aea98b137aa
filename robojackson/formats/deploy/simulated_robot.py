"""A robot in MuJoCo behind the interface of a real one: a part of a deploy pack."""

import time
from typing import Any

import mujoco
import numpy as np


class SimulatedRobot:
    """MuJoCo's robot behind the interface of a real one; its limits always hold."""

    def __init__(self, model: mujoco.MjModel, cfg: dict[str, Any]) -> None:
        self.model, self.data, self.viewer = model, mujoco.MjData(model), None
        self.hung: Any = None  # pose of the root while hung up
        self.joints = [model.joint(i).name for i in range(1, model.njnt)]
        self.motors = np.argsort(model.actuator_trnid[:, 0])
        self.limits = {name: np.array(value) for name, value in cfg["limits"].items()}
        self.substeps = round(cfg["step_dt"] / model.opt.timestep)

    def read(self) -> tuple[np.ndarray, ...]:
        """Return the root's attitude (wxyz), the gyroscope in its axes, joint angles and speeds."""
        qpos, qvel = self.data.qpos.copy(), self.data.qvel.copy()
        return qpos[3:7], qvel[3:6], qpos[7:], qvel[6:]

    def drive(self, target: np.ndarray, stiffness: np.ndarray, damping: np.ndarray) -> None:
        """Run one control step of the PD law, within the limits of joints, torque and speed."""
        most, fastest = self.limits["torque"], self.limits["speed"]
        gear = (self.model.actuator_gear * self.model.actuator_gainprm[:, :1])[self.motors, 0]
        target = np.clip(target, self.limits["lower"], self.limits["upper"])
        for _ in range(self.substeps):
            angle, rate = self.data.qpos[7:], self.data.qvel[6:]
            torque = np.clip(stiffness * (target - angle) - damping * rate, -most, most)
            torque[(np.abs(rate) > fastest) & (torque * rate > 0)] = 0.0
            self.data.ctrl[self.motors] = torque / gear
            mujoco.mj_step(self.model, self.data)
            if self.hung is not None:
                self.data.qpos[:7], self.data.qvel[:6] = self.hung, 0.0
        if self.viewer:
            self.viewer.sync()
            time.sleep(self.substeps * self.model.opt.timestep)
