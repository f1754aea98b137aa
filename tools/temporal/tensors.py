"""Products and constants that do not make a GPU wait."""

from functools import cache

import torch


def turned(rows: torch.Tensor, matrix: torch.Tensor) -> torch.Tensor:
    """Return `rows @ matrix` for matrices of two or three rows: as sums, since a GPU's batched
    product of tiny matrices takes many times as long.

    Args:
        rows: (..., N, K).
        matrix: (..., K, M), broadcast over the leading axes.
    """
    parts = (rows[..., k, None] * matrix[..., None, k, :] for k in range(rows.shape[-1]))
    first, *others = parts
    for part in others:
        first = first + part
    return first


@cache
def index_on(device: torch.device, *rows: int) -> torch.Tensor:
    """Return an index, copied to its device once."""
    return torch.tensor(rows, device=device)


@cache
def numbers_on(device: torch.device, *values: float) -> torch.Tensor:
    """Return a vector of constants, copied to its device once."""
    return torch.tensor(values, device=device)
