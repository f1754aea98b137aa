"""Newton steps on a chain of frames: block-banded normal equations, open or closed to a ring.

Block (k, t) couples frame t with frame t + k, k = 0, 1, 2. A ring (a cyclic clip) is folded, frames
ordered 0, N-1, 1, N-2, ..., so that its corner blocks come back into a band twice as wide.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.linalg import solveh_banded

_REACH = 3  # frames coupled by an acceleration


@dataclass
class Normal:
    """Cost, gradient and Gauss-Newton blocks of N frames with nv unknowns each."""

    cost: float
    gradient: Float[np.ndarray, "N nv"]
    blocks: Float[np.ndarray, "3 N nv nv"]

    @classmethod
    def empty(cls, frames: int, unknowns: int) -> "Normal":
        """Zero cost."""
        blocks = np.zeros((_REACH, frames, unknowns, unknowns))
        return cls(0.0, np.zeros((frames, unknowns)), blocks)

    def add_rows(
        self, residual: Float[np.ndarray, "N R"], jacobian: Float[np.ndarray, "N R nv"]
    ) -> None:
        """Add residuals that depend on their own frame only."""
        transposed = jacobian.swapaxes(1, 2)
        self.cost += 0.5 * float(np.sum(residual**2))
        self.gradient += (transposed @ residual[..., None])[..., 0]
        self.blocks[0] += transposed @ jacobian

    def add_chained(
        self,
        residual: Float[np.ndarray, "M R"],
        jacobians: tuple[Float[np.ndarray, "M R nv"], ...],
        first: Int[np.ndarray, " M"],
    ) -> None:
        """Add residuals of successive frames; jacobians[k] is that of frame first + k."""
        self.cost += 0.5 * float(np.sum(residual**2))
        for i, left in enumerate(jacobians):
            row = (first + i) % len(self.gradient)
            transposed = left.swapaxes(1, 2)
            self.gradient[row] += (transposed @ residual[..., None])[..., 0]
            for j in range(i, len(jacobians)):
                self.blocks[j - i][row] += transposed @ jacobians[j]


@dataclass(frozen=True)
class Chain:
    """The shape of the system: frames, unknowns a frame, and whether the last meets the first."""

    frames: int
    unknowns: int
    ring: bool

    @cached_property
    def place(self) -> np.ndarray:
        """Position of each frame in the band."""
        index = np.arange(self.frames)
        if not self.ring:
            return index
        half = (self.frames + 1) // 2
        return np.where(index < half, 2 * index, 2 * (self.frames - 1 - index) + 1)

    @cached_property
    def bandwidth(self) -> int:
        """Superdiagonals of the band."""
        blocks = 2 * (_REACH - 1) if self.ring else _REACH - 1
        return (blocks + 1) * self.unknowns - 1

    @cached_property
    def layout(self) -> tuple[np.ndarray, np.ndarray]:
        """Flat positions in the band storage, and the flat positions in the blocks they take."""
        n, band, size = self.unknowns, self.bandwidth, self.frames * self.unknowns
        inner_row, inner_column = np.meshgrid(np.arange(n), np.arange(n), indexing="ij")
        targets, sources = [], []
        for k in range(_REACH):
            first = np.arange(self.frames if self.ring else self.frames - k)
            second = (first + k) % self.frames
            row = self.place[first][:, None, None] * n + inner_row
            column = self.place[second][:, None, None] * n + inner_column
            row, column = np.minimum(row, column), np.maximum(row, column)
            source = ((k * self.frames + first)[:, None, None] * n + inner_row) * n + inner_column
            keep = np.broadcast_to((k > 0) | (inner_row <= inner_column), row.shape)
            targets.append(((band + row - column) * size + column)[keep])
            sources.append(source[keep])
        return np.concatenate(targets), np.concatenate(sources)

    def step(
        self, normal: Normal, free: Bool[np.ndarray, "N nv"], damping: float
    ) -> Float[np.ndarray, "N nv"]:
        """Levenberg-Marquardt step of the free unknowns; the others stay.

        Raises:
            numpy.linalg.LinAlgError: The damped matrix is not positive definite.
        """
        band = self._band(normal, free, damping)
        gradient = np.empty_like(normal.gradient)
        gradient[self.place] = normal.gradient * free
        found = solveh_banded(
            band, gradient.ravel(), overwrite_ab=True, overwrite_b=True, check_finite=False
        )
        return np.asarray(-found.reshape(self.frames, self.unknowns)[self.place])

    def _band(self, normal: Normal, free: np.ndarray, damping: float) -> np.ndarray:
        blocks = normal.blocks.copy()
        for k in range(_REACH):
            blocks[k] *= free[:, :, None] * np.roll(free, -k, axis=0)[:, None, :]
        diagonal = np.arange(self.unknowns)
        blocks[0][:, diagonal, diagonal] *= 1.0 + damping
        blocks[0][:, diagonal, diagonal] += 1e-9 + ~free
        band = np.zeros((self.bandwidth + 1) * self.frames * self.unknowns)
        target, source = self.layout
        band[target] = blocks.ravel()[source]
        return band.reshape(self.bandwidth + 1, -1)
