"""Newton steps on a chain of frames: block-banded normal equations, open or closed to a ring.

Block (k, t) couples frame t with frame t + k, k = 0, 1, 2. A ring (a cyclic clip) is folded, frames
ordered 0, N-1, 1, N-2, ..., so that its corner blocks come back into a band twice as wide.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy.lib.stride_tricks import as_strided
from scipy.linalg import solveh_banded

_REACH = 3  # frames coupled by an acceleration
_CHUNK = 64


@dataclass
class Normal:
    """Cost, gradient and Gauss-Newton blocks of N frames with nv unknowns each.

    Terms add their cost at once and what their derivatives take as parts that are computed, in the
    order in which they were added, when the gradient or the blocks are first read: a trial that
    does not lower the cost needs neither.
    """

    cost: float
    _gradient: Float[np.ndarray, "N nv"]
    _blocks: Float[np.ndarray, "3 N nv nv"]
    _parts: list[Callable[[], None]] = field(default_factory=list)

    @classmethod
    def empty(cls, frames: int, unknowns: int) -> "Normal":
        """Return normal equations of zero cost."""
        blocks = np.zeros((_REACH, frames, unknowns, unknowns))
        return cls(0.0, np.zeros((frames, unknowns)), blocks)

    @property
    def shape(self) -> tuple[int, int]:
        """Frames and unknowns."""
        frames, unknowns = self._gradient.shape
        return frames, unknowns

    @property
    def gradient(self) -> Float[np.ndarray, "N nv"]:
        """Derivative of the cost."""
        self._compute()
        return self._gradient

    @property
    def blocks(self) -> Float[np.ndarray, "3 N nv nv"]:
        """Gauss-Newton blocks (k, t) of frames t and t + k."""
        self._compute()
        return self._blocks

    def later(self, part: Callable[[], None]) -> None:
        """Leave a part that adds to the gradient and the blocks until they are read."""
        self._parts.append(part)

    def _compute(self) -> None:
        parts, self._parts = self._parts, []
        for part in parts:
            part()

    def add_rows(
        self,
        residual: Float[np.ndarray, "N R"],
        jacobian: Callable[[], Float[np.ndarray, "N R nv"]],
    ) -> None:
        """Add residuals that depend on their own frame only."""
        self.cost += 0.5 * float(np.sum(residual**2))

        def add() -> None:
            rows = jacobian()
            transposed = rows.swapaxes(1, 2)
            self.gradient[:] += (transposed @ residual[..., None])[..., 0]
            self.blocks[0] += transposed @ rows

        self.later(add)

    def add_chained(
        self,
        residual: Float[np.ndarray, "M R"],
        jacobians: Callable[[], tuple[Float[np.ndarray, "M R nv"], ...]],
        first: Int[np.ndarray, " M"],
    ) -> None:
        """Add residuals of successive frames; jacobians()[k] is that of frame first + k."""
        self.cost += 0.5 * float(np.sum(residual**2))
        self.later(lambda: self._chain(residual, jacobians(), first))

    def _chain(
        self,
        residual: Float[np.ndarray, "M R"],
        jacobians: tuple[Float[np.ndarray, "M R nv"], ...],
        first: Int[np.ndarray, " M"],
    ) -> None:
        for i, left in enumerate(jacobians):
            row = as_rows((first + i) % len(self._gradient))
            transposed = left.swapaxes(1, 2)
            self._gradient[row] += (transposed @ residual[..., None])[..., 0]
            for j in range(i, len(jacobians)):
                self._blocks[j - i][row] += transposed @ jacobians[j]

    def add_square(
        self,
        gradient: Float[np.ndarray, "M 3nv"],
        rows: Float[np.ndarray, "M R 3nv"],
        first: Int[np.ndarray, " M"],
    ) -> None:
        """Add gradient and squared rows in the unknowns of three successive frames at once."""
        unknowns = self.shape[1]
        square = rows.swapaxes(1, 2) @ rows
        part = [slice(k * unknowns, (k + 1) * unknowns) for k in range(_REACH)]
        for i in range(_REACH):
            row = as_rows((first + i) % len(self._gradient))
            self._gradient[row] += gradient[:, part[i]]
            for j in range(i, _REACH):
                self._blocks[j - i][row] += square[:, part[i], part[j]]


def as_rows(frames: Int[np.ndarray, " M"]) -> Int[np.ndarray, " M"] | slice:
    """Return a slice where possible: it is faster than an index array."""
    if len(frames) and (np.diff(frames) == 1).all():
        return slice(int(frames[0]), int(frames[-1]) + 1)
    return frames


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
        """Return Levenberg-Marquardt step of the free unknowns; the others stay.

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
        if not self.ring:
            return self._open_band(normal, free, damping)
        blocks = np.empty_like(normal.blocks)
        for k in range(_REACH):
            blocks[k] = self._masked(normal, free, damping, k, slice(0, self.frames))
        band = np.zeros((self.bandwidth + 1) * self.frames * self.unknowns)
        target, source = self.layout
        band[target] = blocks.ravel()[source]
        return band.reshape(self.bandwidth + 1, -1)

    def _masked(
        self, normal: Normal, free: np.ndarray, damping: float, k: int, rows: slice
    ) -> np.ndarray:
        """Return the blocks (k, rows) without the unknowns that are held, damped."""
        others = free[rows] if k == 0 else free[np.arange(rows.start, rows.stop) + k - len(free)]
        blocks = normal.blocks[k, rows] * (free[rows][:, :, None] & others[:, None])
        if k == 0:
            diagonal = np.arange(self.unknowns)
            blocks[:, diagonal, diagonal] *= 1.0 + damping
            blocks[:, diagonal, diagonal] += 1e-9 + ~free[rows]
        return np.asarray(blocks)

    def _open_band(self, normal: Normal, free: np.ndarray, damping: float) -> np.ndarray:
        """Return the band of an open chain, column by column in LAPACK's layout.

        Entry (a, b) of block (k, t) stands in column (t + k) nv + b, `bandwidth - k nv + a - b`
        from its top: in memory one strided square for each block. Built a few frames at a time,
        which stay in the cache.
        """
        n, band, columns = self.unknowns, self.bandwidth, self._columns
        columns[:] = 0.0
        upper, size = np.tri(n).T, columns.itemsize
        for k in range(_REACH):
            for start in range(0, self.frames - k, _CHUNK):
                rows = slice(start, min(start + _CHUNK, self.frames - k))
                square = as_strided(
                    columns[start + k :, band - k * n :],
                    (rows.stop - start, n, n),
                    (columns.strides[0], size, band * size),
                )
                blocks = self._masked(normal, free, damping, k, rows)
                square += blocks * upper if k == 0 else blocks
        return columns.reshape(self.frames * n, band + 1).T

    @cached_property
    def _columns(self) -> np.ndarray:
        """Room for the band of an open chain."""
        return np.empty((self.frames, self.unknowns * (self.bandwidth + 1)))
