"""Reward of a rehearsing robot, and when it is lost: torch twin of `rl.modes.rewards`.

Metres, radians, seconds.
"""

from collections.abc import Mapping

import numpy as np
import torch

from tools.dancer.mujoco_robots import Robots
from tools.dancer.repertoire import Steps, matrix

LOST_HEIGHT_M, LOST_TILT, LOST_SITES_M, LOST_ENDS_M = 0.22, 0.75, 0.22, 0.25
"""Distances from the reference at which a robot is lost: the root's height, its up axis, the mean
of the keypoints relative to the pelvis, the height of a hand or foot."""
REWARD_SCALE = 0.1
BELLS = {
    "joints": (0.12, 0.25), "sites": (0.24, 0.10), "far": (0.10, 0.25), "feet": (0.10, 0.08),
    "orientation": (0.12, 0.4), "height": (0.10, 0.08), "velocity": (0.10, 0.5),
    "spin": (0.05, 2.0), "joint_speed": (0.05, 2.0), "limb_speed": (0.14, 0.6),
}  # fmt: skip
"""Weight and width of every term, as in `RewardConfig`; `far` is a wider bell of the sites."""
FINE, NARROW = 0.4, 0.35
ACTION_RATE = 0.3


class Scoring:
    """Reward and loss of robots; special points as in `rl.modes.rewards.TrackedPoints`."""

    def __init__(self, pack: Mapping[str, np.ndarray], device: str) -> None:
        self._limbs, self._feet = (
            torch.as_tensor(pack[name], device=device) for name in ("limbs", "feet")
        )
        self._ends, self._pelvis = self._limbs[:4], int(pack["pelvis"])

    def judge(
        self, robots: Robots, at: Steps, moved: torch.Tensor, change: torch.Tensor
    ) -> tuple[torch.Tensor, torch.Tensor]:
        """Return rewards (N,) and which robots are lost (N,).

        Args:
            at: The references at the same step.
            moved: Velocities of the keypoints, (N, K, 3).
            change: Mean squared change of the actions, (N,).
        """
        qpos, points = robots.qpos, robots.points
        apart = _from(points, self._pelvis) - _from(at.points, self._pelvis)
        squares = self._squares(robots, at, moved, apart)
        total = torch.zeros(robots.n, device=qpos.device)
        for name, (weight, width) in BELLS.items():
            ratio = squares[name] / width**2
            fine = torch.exp(-ratio / NARROW**2)
            total += weight * ((1 - FINE) * torch.exp(-ratio) + FINE * fine)
        up, aim = (matrix(q[:, 3:7])[:, :, 2] for q in (qpos, at.qpos))
        ends = (points - at.points)[:, self._ends, 2].abs().amax(1)
        lost = (qpos[:, 2] - at.qpos[:, 2]).abs() > LOST_HEIGHT_M
        lost |= ((up * aim).sum(1) < np.cos(LOST_TILT)) | (ends > LOST_ENDS_M)
        lost |= apart.square().sum(-1).sqrt().mean(1) > LOST_SITES_M
        reward = torch.nan_to_num(REWARD_SCALE * (total - ACTION_RATE * change))
        return reward, lost | ~torch.isfinite(qpos).all(1)

    def _squares(
        self, robots: Robots, at: Steps, moved: torch.Tensor, apart: torch.Tensor
    ) -> dict[str, torch.Tensor]:
        """Return the squared errors of all terms, (N,) each."""
        place, speed = robots.qpos - at.qpos, robots.qvel - at.qvel
        far = apart.square().sum(-1).mean(1)
        lifted = apart[:, self._feet].clone()
        lifted[..., 2] = (robots.points - at.points)[:, self._feet, 2]
        turned = matrix(robots.qpos[:, 3:7]) * matrix(at.qpos[:, 3:7])
        cosine = ((turned.sum((1, 2)) - 1) / 2).clamp(-1 + 1e-6, 1 - 1e-6)
        hurry = (moved - at.moved)[:, self._limbs]
        return {
            "joints": place[:, 7:].square().mean(1), "sites": far, "far": far,
            "feet": lifted.square().sum(-1).mean(1), "orientation": torch.acos(cosine).square(),
            "height": place[:, 2].square(), "velocity": speed[:, :3].square().sum(1),
            "spin": speed[:, 3:6].square().sum(1), "joint_speed": speed[:, 6:].square().mean(1),
            "limb_speed": hurry.square().sum(-1).mean(1),
        }  # fmt: skip


def _from(points: torch.Tensor, centre: int) -> torch.Tensor:
    return points - points[:, centre, None]
