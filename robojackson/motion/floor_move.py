"""Moves over the floor: a turn about the vertical and a shift, which change no dynamics.

N moves for N states, or one for many. Metres, radians, quaternions wxyz.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from robojackson.geometry.rotations import heading, quat_multiply


@dataclass(frozen=True)
class FloorMove:
    """x -> R(turn) x + shift, of what lies in one frame into another.

    Attributes:
        turn: About the vertical, rad.
        shift: Over the floor, m.
    """

    turn: Float[np.ndarray, " N"]
    shift: Float[np.ndarray, "N 2"]

    @classmethod
    def none(cls, count: int) -> "FloorMove":
        """Return moves that leave everything where it is."""
        return cls(np.zeros(count), np.zeros((count, 2)))

    @classmethod
    def onto(
        cls, qpos: Float[np.ndarray, "N nq"], target: Float[np.ndarray, "N nq"]
    ) -> "FloorMove":
        """Return the move that puts the roots of `qpos` over those of `target`, headings too."""
        turn = heading(target[:, 3:7]) - heading(qpos[:, 3:7])
        return cls(turn, target[:, :2] - _turned(qpos[:, :2], turn))

    def inverse(self) -> "FloorMove":
        """Return the way back."""
        return FloorMove(-self.turn, -_turned(self.shift, -self.turn))

    def qpos(self, qpos: Float[np.ndarray, "N nq"]) -> Float[np.ndarray, "N nq"]:
        """Return states of robots with a free root, moved."""
        moved = qpos.copy()
        moved[:, :2] = _turned(qpos[:, :2], self.turn) + self.shift
        half = np.broadcast_to(self.turn / 2, len(qpos))
        zero = np.zeros(len(qpos))
        about = np.stack([np.cos(half), zero, zero, np.sin(half)], -1)
        moved[:, 3:7] = quat_multiply(about, qpos[:, 3:7])
        return moved

    def qvel(self, qvel: Float[np.ndarray, "N nv"]) -> Float[np.ndarray, "N nv"]:
        """Return their velocities; those of turns are in the root's own frame."""
        moved = qvel.copy()
        moved[:, :2] = _turned(qvel[:, :2], self.turn)
        return moved

    def points(self, points: Float[np.ndarray, "N K 3"]) -> Float[np.ndarray, "N K 3"]:
        """Return points of theirs."""
        moved = points.copy()
        moved[..., :2] = _turned(points[..., :2], self.turn[:, None]) + self.shift[:, None]
        return moved


def _turned(flat: Float[np.ndarray, "*B 2"], turn: np.ndarray) -> Float[np.ndarray, "*B 2"]:
    c, s = np.cos(turn), np.sin(turn)
    x, y = flat[..., 0], flat[..., 1]
    return np.stack([c * x - s * y, s * x + c * y], -1)
