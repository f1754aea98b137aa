"""A few robots side by side in MuJoCo itself: what `warp_robots` does, on a processor.

World frame, metres, radians, seconds, newton-metres; torch tensors of single precision.
"""

from collections.abc import Mapping
from typing import Protocol

import mujoco
import numpy as np
import torch


class Robots(Protocol):
    """N robots under the PD law of `rl.sim.simulation`.

    Attributes:
        qpos, qvel: States, (N, nq) and (N, nv); what is written there is the state.
        points: Keypoints, world, (N, K, 3); of the last step.
        targets: Target angles of the motors, (N, nu).
        strength: Factor on the gains of every robot, (N,).
        friction: Friction of every geom, (N, G, 3).
    """

    n: int
    qpos: torch.Tensor
    qvel: torch.Tensor
    points: torch.Tensor
    targets: torch.Tensor
    strength: torch.Tensor
    friction: torch.Tensor

    def step(self) -> None:
        """Run one control step towards `targets`."""

    def place(
        self, rows: torch.Tensor, qpos: torch.Tensor, qvel: torch.Tensor, points: torch.Tensor
    ) -> None:
        """Put the robots of a mask (N,) into states with these keypoints; others keep theirs."""


def model_of(pack: Mapping[str, np.ndarray]) -> mujoco.MjModel:
    """Return the model of a pack."""
    name = "dancer.mjb"
    return mujoco.MjModel.from_binary_path(name, {name: pack["model"].tobytes()})


class MujocoRobots:
    """N robots, one after the other (`Robots` protocol).

    Args:
        pack: Arrays of `tools.dancer.pack`.
    """

    def __init__(self, pack: Mapping[str, np.ndarray], n: int) -> None:
        self._model, self.n = model_of(pack), n
        self._datas = [mujoco.MjData(self._model) for _ in range(n)]
        names = ("kp", "kd", "limit", "gear")
        self._kp, self._kd, self._limit, self._gear = (pack[name].astype(float) for name in names)
        self._hinge, self._sites = pack["hinge"], pack["sites"]
        self._substeps = int(pack["substeps"])
        self.qpos, self.qvel = torch.zeros(n, self._model.nq), torch.zeros(n, self._model.nv)
        self.points = torch.zeros(n, len(self._sites), 3)
        self.targets, self.strength = torch.zeros(n, self._model.nu), torch.ones(n)
        self.friction = torch.as_tensor(self._model.geom_friction, dtype=torch.float32).repeat(
            n, 1, 1
        )

    def step(self) -> None:
        """Run one control step towards `targets`."""
        model = self._model
        for i, data in enumerate(self._datas):
            model.geom_friction[:] = self.friction[i].numpy()
            data.qpos[:], data.qvel[:] = self.qpos[i].numpy(), self.qvel[i].numpy()
            targets, strength = self.targets[i].numpy().astype(float), float(self.strength[i])
            for _ in range(self._substeps):
                apart = targets - data.qpos[7:][self._hinge]
                torque = strength * (self._kp * apart - self._kd * data.qvel[6:][self._hinge])
                data.ctrl[:] = np.clip(torque, -self._limit, self._limit) / self._gear
                mujoco.mj_step(model, data)
            mujoco.mj_kinematics(model, data)
            self.qpos[i], self.qvel[i] = torch.as_tensor(data.qpos), torch.as_tensor(data.qvel)
            self.points[i] = torch.as_tensor(data.site_xpos[self._sites])

    def place(
        self, rows: torch.Tensor, qpos: torch.Tensor, qvel: torch.Tensor, points: torch.Tensor
    ) -> None:
        """Put the robots of a mask (N,) into states with these keypoints; others keep theirs."""
        for i in torch.nonzero(rows)[:, 0].tolist():
            mujoco.mj_resetData(self._model, self._datas[i])
            self.qpos[i], self.qvel[i], self.points[i] = qpos[i], qvel[i], points[i]
