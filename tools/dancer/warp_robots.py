"""Thousands of robots side by side in MuJoCo Warp (`mujoco-warp`), on a GPU.

World frame, metres, radians, seconds, newton-metres. A control step is one CUDA graph; Warp's
stream waits for torch's and the other way round, as both are the device's default ones.
"""

from collections.abc import Mapping

import mujoco_warp as mjw
import numpy as np
import torch
import warp as wp

from tools.dancer.mujoco_robots import model_of

MOST_CONTACTS, MOST_ROWS = 32, 128
"""Contacts and constraint rows of a robot; those of one that lies on the floor may be cut off."""


@wp.kernel
def pd_law(
    qpos: wp.array2d(dtype=float),
    qvel: wp.array2d(dtype=float),
    targets: wp.array2d(dtype=float),
    strength: wp.array(dtype=float),
    hinge: wp.array(dtype=int),
    kp: wp.array(dtype=float),
    kd: wp.array(dtype=float),
    limit: wp.array(dtype=float),
    gear: wp.array(dtype=float),
    ctrl: wp.array2d(dtype=float),
):
    """Write the controls of every robot (first axis) and motor (second) for its state."""
    i, j = wp.tid()
    stiff = strength[i] * kp[j]
    soft = strength[i] * kd[j]
    torque = stiff * (targets[i, j] - qpos[i, 7 + hinge[j]]) - soft * qvel[i, 6 + hinge[j]]
    ctrl[i, j] = wp.clamp(torque, -limit[j], limit[j]) / gear[j]


class WarpRobots:
    """N robots (`mujoco_robots.Robots`); `qpos` and `qvel` are the simulation's own memory.

    Args:
        pack: Arrays of `tools.dancer.pack`.
    """

    def __init__(self, pack: Mapping[str, np.ndarray], n: int, device: str) -> None:
        model = model_of(pack)
        self._device, self.n = device, n
        with wp.ScopedDevice(device):
            self._model = mjw.put_model(model, batch_sizes={"geom_friction": n})
            self._model.opt.warn_overflow = 0  # a robot that lies on the floor
            self._data = mjw.make_data(model, nworld=n, nconmax=MOST_CONTACTS, njmax=MOST_ROWS)
            names = ("kp", "kd", "limit", "gear")
            constants = [wp.array(pack[name], dtype=float) for name in names]
            self._hinge = wp.array(pack["hinge"].astype(np.int32), dtype=int)
            self._targets = wp.zeros((n, model.nu), dtype=float)
            self._strength = wp.ones(n, dtype=float)
        self._constants, self._substeps = constants, int(pack["substeps"])
        self._sites = torch.as_tensor(pack["sites"], device=device)
        self.qpos, self.qvel = wp.to_torch(self._data.qpos), wp.to_torch(self._data.qvel)
        self._warm = wp.to_torch(self._data.qacc_warmstart)
        self._site_places = wp.to_torch(self._data.site_xpos)
        self.targets, self.strength = wp.to_torch(self._targets), wp.to_torch(self._strength)
        self.friction = wp.to_torch(self._model.geom_friction)
        self.points = torch.zeros((n, len(self._sites), 3), device=device)
        self._advance()
        self._graph = self._captured() if device.startswith("cuda") else None

    def step(self) -> None:
        """Run one control step towards `targets`."""
        if self._graph is None:
            self._advance()
        else:
            wp.capture_launch(self._graph)
        self.points.copy_(self._site_places[:, self._sites])

    def place(
        self, rows: torch.Tensor, qpos: torch.Tensor, qvel: torch.Tensor, points: torch.Tensor
    ) -> None:
        """Put the robots of a mask (N,) into states with these keypoints; others keep theirs."""
        wide = rows[:, None]
        self.qpos.copy_(torch.where(wide, qpos, self.qpos))
        self.qvel.copy_(torch.where(wide, qvel, self.qvel))
        self._warm.masked_fill_(wide, 0.0)
        self.points.copy_(torch.where(wide[..., None], points, self.points))

    def _advance(self) -> None:
        data, shape = self._data, self._targets.shape
        inputs = [
            data.qpos,
            data.qvel,
            self._targets,
            self._strength,
            self._hinge,
            *self._constants,
        ]
        with wp.ScopedDevice(self._device):
            for _ in range(self._substeps):
                wp.launch(pd_law, dim=shape, inputs=inputs, outputs=[data.ctrl])
                mjw.step(self._model, data)
            mjw.kinematics(self._model, data)

    def _captured(self) -> wp.Graph:
        with wp.ScopedDevice(self._device), wp.ScopedCapture() as capture:
            self._advance()
        return capture.graph
