"""What a rehearsing robot sees: torch twin of `rl.modes.observation`, kind `preview`.

The dancer sees the first part or all, its critic all. Metres, radians, seconds, scaled to about
one.
"""

from collections.abc import Mapping

import numpy as np
import torch

from tools.dancer.mujoco_robots import Robots
from tools.dancer.repertoire import Steps, matrix

SPEED_SCALE, HINGE_SPEED_SCALE, POINT_SCALE, ROOT_SCALE, CLIP = 0.3, 0.1, 2.0, 3.0, 10.0
USUAL_HEIGHT_M = 1.2
UNMEASURED = 15
"""Numbers that only a simulation knows, beside the keypoints."""
NOISE = 0.25
"""Of the pack's noise of gyroscope, attitude, hinges and speeds of hinges, uniform between plus and
minus."""


class Sight:
    """Observations of robots.

    Attributes:
        actor_size: Length of the part that the dancer sees.
        noise: Factor on the noise of the sensors, a scalar that may be written in place.
    """

    def __init__(
        self,
        pack: Mapping[str, np.ndarray],
        preview: int,
        random: torch.Generator,
        everything: bool = False,
    ) -> None:
        self._random, self._rest = random, torch.as_tensor(pack["rest"], device=random.device)
        self.actor_size = 9 + 4 * len(pack["rest"]) + len(pack["scale"]) + preview
        if everything:
            self.actor_size += UNMEASURED + 3 * len(pack["sites"])
        self._everything = everything
        self._widths = [NOISE * float(width) for width in pack["sensors"]]
        self.noise = torch.ones((), device=random.device)

    def observe(self, robots: Robots, at: Steps, action: torch.Tensor) -> torch.Tensor:
        """Return the observations (N, D) of robots whose next reference step is `at`.

        Args:
            action: Last action, -1..1.
        """
        qpos, qvel = robots.qpos, robots.qvel
        turned = matrix(qpos[:, 3:7])
        turn = turned.transpose(1, 2) @ matrix(at.qpos[:, 3:7])
        attitude = torch.cat([turn[:, :, 0], turn[:, :, 1]], 1)
        measured = (qvel[:, 3:6], attitude, qpos[:, 7:], qvel[:, 6:])
        gyro, attitude, hinges, speeds = self._sensed(measured)
        angle = 2 * np.pi * (0 * at.phase if self._everything else at.phase)
        vectors = torch.stack([qvel[:, :3], at.qpos[:, :3] - qpos[:, :3], at.qvel[:, :3]], 1)
        velocity, offset, travel = (vectors @ turned).unbind(1)
        apart = ((at.points - robots.points) @ turned).flatten(1) * POINT_SCALE
        parts = [
            gyro * SPEED_SCALE, attitude, hinges - self._rest, speeds * HINGE_SPEED_SCALE,
            at.qpos[:, 7:] - self._rest, at.qvel[:, 6:] * HINGE_SPEED_SCALE, action * 0.5,
            at.preview, qpos[:, 2:3] - USUAL_HEIGHT_M, turned[:, 2], velocity,
            torch.stack([torch.sin(angle), torch.cos(angle)], 1),
            offset * ROOT_SCALE, travel, apart,
        ]  # fmt: skip
        return torch.nan_to_num(torch.cat(parts, 1)).clamp(-CLIP, CLIP)

    def _sensed(self, values: tuple[torch.Tensor, ...]) -> list[torch.Tensor]:
        count = sum(value.shape[1] for value in values)
        shape, device = (len(values[0]), count), self._random.device
        drawn = 2 * torch.rand(shape, generator=self._random, device=device) - 1
        noise = (self.noise * drawn).split([value.shape[1] for value in values], 1)
        return [value + width * one
                for value, width, one in zip(values, self._widths, noise, strict=True)]  # fmt: skip
