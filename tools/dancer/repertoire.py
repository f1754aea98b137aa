"""The dancer's motions on a device: every step of every motion, its mirror image, what is ahead.

Frames and units as in `ReferenceMotion`; the preview is that of `rl.sim.preview`.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import torch

AHEAD_S = (0.1, 0.2, 0.4, 0.7)
DISTANCE_SCALE = 3.0
ACROSS = (1.0, -1.0, 1.0)
TURN = (1.0, -1.0, 1.0, -1.0)
"""Mirror of places and of quaternions; that of rotation vectors is the negative of the first."""


@dataclass(frozen=True)
class Steps:
    """The references of N robots at one step each.

    Attributes:
        qpos, qvel: States, (N, nq) and (N, nv).
        points, moved: Keypoints and their velocities, (N, K, 3).
        lead: Offsets of the motors' targets, (N, nu).
        preview: What is ahead, (N, P).
        phase: Phase of the motion, 0..1.
    """

    qpos: torch.Tensor
    qvel: torch.Tensor
    points: torch.Tensor
    moved: torch.Tensor
    lead: torch.Tensor
    preview: torch.Tensor
    phase: torch.Tensor


class Motions:
    """All motions, each followed by its mirror image; motion 2 m is the m-th of the pack.

    Attributes:
        first, length: First row of each motion among the joined steps, and its steps, (M,).
        cyclic: Whether it repeats.
        motion: Motion of every joined step, (S,).
        dt: Seconds a step.
    """

    def __init__(self, pack: Mapping[str, np.ndarray], device: str) -> None:
        own = {name: torch.as_tensor(pack[name], device=device)
               for name in ("qpos", "qvel", "points", "lead", "offset", "rest")}  # fmt: skip
        self.dt, self._rest = float(pack["dt"]), own["rest"]
        self._root_height = float(pack["root_height"])
        image = _image(pack, own)
        counts = np.repeat(pack["length"], 2)
        first = np.cumsum(counts) - counts
        self.length = torch.as_tensor(counts, device=device)
        self.first = torch.as_tensor(first, device=device)
        self.cyclic = torch.as_tensor(np.repeat(pack["cyclic"], 2), device=device)
        ends = np.cumsum(pack["length"])
        self.qpos, self.qvel, self.points, self.lead = (
            _woven(own[name], image[name], ends) for name in ("qpos", "qvel", "points", "lead")
        )
        self.offset = torch.stack([own["offset"], image["offset"]], 1).flatten(0, 1)
        self.motion = torch.repeat_interleave(torch.arange(len(counts), device=device), self.length)
        here = torch.arange(len(self.qpos), device=device) - self.first[self.motion]
        self.moved = self._velocities(here)
        self.preview = self._ahead(here)

    def at(self, motion: torch.Tensor, step: torch.Tensor) -> Steps:
        """Return the references; a cyclic motion goes on, another holds its last step."""
        row, shift, phase = self.split(motion, step)
        qpos = self.qpos[row]
        qpos[:, :3] += shift
        points = self.points[row] + shift[:, None]
        rest = (self.qvel[row], points, self.moved[row], self.lead[row], self.preview[row])
        return Steps(qpos, *rest, phase)

    def row(self, motion: torch.Tensor, step: torch.Tensor) -> torch.Tensor:
        """Return rows of the joined steps of all motions."""
        return self.split(motion, step)[0]

    def ended(self, motion: torch.Tensor, step: torch.Tensor) -> torch.Tensor:
        """Return whether a motion that is not cyclic has come to its end."""
        return ~self.cyclic[motion] & (step >= self.length[motion] - 1)

    def split(
        self, motion: torch.Tensor, step: torch.Tensor
    ) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
        """Return rows of the joined steps, how far earlier cycles have moved, and the phase."""
        length = self.length[motion]
        cycle = torch.where(self.cyclic[motion], step // length, 0)
        index = torch.minimum(step - cycle * length, length - 1)
        return self.first[motion] + index, cycle[:, None] * self.offset[motion], index / length

    def _velocities(self, here: torch.Tensor) -> torch.Tensor:
        """Return backward differences of the keypoints."""
        start = here == 0
        before = torch.roll(self.points, 1, 0)
        last = self.points[self.first[self.motion] + self.length[self.motion] - 1]
        wrapped = last - self.offset[self.motion][:, None]
        first = torch.where(self.cyclic[self.motion][:, None, None], wrapped, self.points)
        before = torch.where(start[:, None, None], first, before)
        return (self.points - before) / self.dt

    def _ahead(self, here: torch.Tensor) -> torch.Tensor:
        """Return the preview of every step."""
        yaw = heading(self.qpos[:, 3:7])
        cos, sin = torch.cos(yaw), torch.sin(yaw)
        parts = []
        for seconds in AHEAD_S:
            row, shift, _ = self.split(self.motion, here + round(seconds / self.dt))
            there = self.qpos[row]
            place = there[:, :3] + shift
            moved = place[:, :2] - self.qpos[:, :2]
            ahead = torch.stack([cos * moved[:, 0] + sin * moved[:, 1],
                                 cos * moved[:, 1] - sin * moved[:, 0],
                                 place[:, 2] - self.qpos[:, 2],
                                 place[:, 2] - self._root_height], 1)  # fmt: skip
            turn = heading(there[:, 3:7]) - yaw
            turns = torch.stack([torch.sin(turn), torch.cos(turn)], 1)
            up = matrix(there[:, 3:7])[:, 2]
            parts += [DISTANCE_SCALE * ahead, turns, up, there[:, 7:] - self._rest]
        return torch.cat(parts, 1)


def matrix(q: torch.Tensor) -> torch.Tensor:
    """Return the rotation matrices (N, 3, 3) of unit quaternions wxyz (N, 4)."""
    w, x, y, z = q.unbind(-1)
    rows = [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),
            2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
            2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]  # fmt: skip
    return torch.stack(rows, -1).unflatten(-1, (3, 3))


def heading(q: torch.Tensor) -> torch.Tensor:
    """Return the angle of the x axis of quaternions wxyz over the floor, rad."""
    turned = matrix(q)
    return torch.atan2(turned[:, 1, 0], turned[:, 0, 0])


class Mirror:
    """States of the robot in a mirror across the world's x-z plane; twice is as it was."""

    def __init__(self, pack: Mapping[str, np.ndarray], device: str) -> None:
        self._across, self._turn = (torch.tensor(x, device=device) for x in (ACROSS, TURN))
        self._partner, self._sign, self._point, hinge = (
            torch.as_tensor(pack[name], device=device)
            for name in ("mirror_hinge", "mirror_sign", "mirror_point", "hinge")
        )
        self._motor = torch.argsort(hinge)[self._partner[hinge]]
        self._motor_sign = self._sign[hinge]

    def qpos(self, qpos: torch.Tensor) -> torch.Tensor:
        """Return the mirrored poses, (N, nq)."""
        hinges = qpos[:, 7:][:, self._partner] * self._sign
        return torch.cat([qpos[:, :3] * self._across, qpos[:, 3:7] * self._turn, hinges], 1)

    def qvel(self, qvel: torch.Tensor) -> torch.Tensor:
        """Return the mirrored velocities, (N, nv)."""
        speeds = qvel[:, 6:][:, self._partner] * self._sign
        return torch.cat([qvel[:, :3] * self._across, qvel[:, 3:6] * -self._across, speeds], 1)

    def points(self, points: torch.Tensor) -> torch.Tensor:
        """Return the mirrored keypoints, (N, K, 3)."""
        return points[:, self._point] * self._across

    def places(self, places: torch.Tensor) -> torch.Tensor:
        """Return mirrored places, (N, 3)."""
        return places * self._across

    def motors(self, moved: torch.Tensor) -> torch.Tensor:
        """Return mirrored offsets of the motors' targets, or actions, (N, nu)."""
        return moved[:, self._motor] * self._motor_sign


def _image(pack: Mapping[str, np.ndarray], own: dict[str, torch.Tensor]) -> dict[str, torch.Tensor]:
    """Return the mirror images of the motions."""
    mirror = Mirror(pack, str(own["qpos"].device))
    image = {name: getattr(mirror, name)(own[name]) for name in ("qpos", "qvel", "points")}
    return image | {"lead": mirror.motors(own["lead"]), "offset": mirror.places(own["offset"])}


def _woven(own: torch.Tensor, image: torch.Tensor, ends: np.ndarray) -> torch.Tensor:
    """Return every motion followed by its image."""
    cuts = ends[:-1].tolist()
    pairs = zip(torch.tensor_split(own, cuts), torch.tensor_split(image, cuts), strict=True)
    return torch.cat([part for pair in pairs for part in pair])
