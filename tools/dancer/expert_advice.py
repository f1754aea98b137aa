"""What the experts of `tools.dancer.experts` advise robots that are on their way through motions.

World frame, metres, radians, seconds.
"""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import torch

from tools.dancer.mujoco_robots import Robots
from tools.dancer.repertoire import Mirror, Motions

LOW_M = 0.02
"""As in `rl.feedback.standing_feet`."""
SMALL = 1e-6
MOST_ADVICE = 0.5
"""Root mean square of the advised actions, full ones, up to which the linear law is believed."""


class Experts:
    """Advice for robots on their way through motions and their mirror images.

    Args:
        pack: Arrays of `tools.dancer.pack`.
        motions: Its motions on the device.
    """

    def __init__(self, pack: Mapping[str, np.ndarray], motions: Motions, device: str) -> None:
        self._motions, self._names, self._length = motions, list(pack["names"]), pack["length"]
        self._start = np.cumsum(self._length) - self._length
        steps, nu = pack["lead"].shape
        nq, nv = pack["qpos"].shape[1], pack["qvel"].shape[1]
        shapes = {"width": (2 * nv,), "offset": (nu,), "qpos": (nq,), "qvel": (nv,),
                  "places": (len(pack["supports"]), 3)}  # fmt: skip
        self._tables = {
            name: torch.zeros((steps, *shape), device=device) for name, shape in shapes.items()
        }
        self._tables["code"] = torch.zeros((steps, nu, 2 * nv), dtype=torch.int8, device=device)
        self._feet, self._scale = (
            torch.as_tensor(pack[name], device=device) for name in ("supports", "scale")
        )
        self._mirror = Mirror(pack, device)
        self._own_first = torch.as_tensor(np.repeat(self._start, 2), device=device)
        self._knows = torch.zeros(2 * len(self._names), dtype=torch.bool, device=device)
        self._taken: set[str] = set()

    def take(self, folder: Path) -> int:
        """Read the files of a folder that are new; return how many motions have an expert."""
        for number, name in enumerate(self._names):
            path = folder / f"{name}.npz"
            if name in self._taken or not path.is_file():
                continue
            with np.load(path) as arrays:
                rows = slice(self._start[number], self._start[number] + self._length[number])
                for key, table in self._tables.items():
                    table[rows] = torch.as_tensor(arrays[key]).to(table)
                self._knows[2 * number : 2 * number + 2] = True
            self._taken.add(name)
        return int(self._knows.sum()) // 2

    def advise(
        self, robots: Robots, motion: torch.Tensor, step: torch.Tensor
    ) -> tuple[torch.Tensor, torch.Tensor]:
        """Return the actions (N, nu) that the experts advise, and which robots have one (N,)."""
        row, shift, _ = self._motions.split(motion, step)
        row = row - self._motions.first[motion] + self._own_first[motion]
        image = (motion % 2 == 1)[:, None]
        mirror, points = self._mirror, robots.points - shift[:, None]
        qpos = torch.cat([robots.qpos[:, :3] - shift, robots.qpos[:, 3:]], 1)
        qpos = torch.where(image, mirror.qpos(qpos), qpos)
        qvel = torch.where(image, mirror.qvel(robots.qvel), robots.qvel)
        points = torch.where(image[..., None], mirror.points(points), points)
        found = {name: table[row] for name, table in self._tables.items()}
        apart = self._apart(qpos, qvel, points, found)
        gain = found["code"].float() * found["width"][:, None]
        moved = (gain @ apart[:, :, None])[:, :, 0] + found["offset"]
        action = torch.nan_to_num(-moved / self._scale)
        near = action.square().mean(1) < MOST_ADVICE**2
        action = torch.where(image, mirror.motors(action), action)
        return action.clamp(-1, 1), self._knows[motion] & near

    def _apart(
        self, qpos: torch.Tensor, qvel: torch.Tensor, points: torch.Tensor,
        aim: Mapping[str, torch.Tensor],
    ) -> torch.Tensor:  # fmt: skip
        """Return the distances of states from nominal ones, which are moved to where feet stand."""
        feet, nominal = points[:, self._feet], aim["qpos"]
        low = torch.exp(-(feet[..., 2] - feet[..., 2].amin(1, keepdim=True)) / LOW_M)
        off = (low[..., None] * (feet - aim["places"])[..., :2]).sum(1) / low.sum(1, keepdim=True)
        place = qpos[:, :3] - nominal[:, :3]
        place[:, :2] -= torch.nan_to_num(off)  # NaN: the path stays in the world
        turn = rotation_between(nominal[:, 3:7], qpos[:, 3:7])
        return torch.cat([place, turn, qpos[:, 7:] - nominal[:, 7:], qvel - aim["qvel"]], 1)


def rotation_between(a: torch.Tensor, b: torch.Tensor) -> torch.Tensor:
    """Return the rotation vectors (N, 3), in the frame of a, from quaternions a to b (N, 4)."""
    w, v = a[:, :1], -a[:, 1:]
    real = w * b[:, :1] - (v * b[:, 1:]).sum(1, keepdim=True)
    vector = w * b[:, 1:] + b[:, :1] * v + torch.linalg.cross(v, b[:, 1:])
    vector = torch.where(real < 0, -vector, vector)
    sine = vector.norm(dim=1, keepdim=True)
    angle = 2 * torch.atan2(sine, real.abs())
    return vector * torch.where(sine > SMALL, angle / sine.clamp(min=SMALL), 2.0)
