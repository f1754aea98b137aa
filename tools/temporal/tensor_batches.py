"""Batches as tensors, drawn beside the training by worker processes where it has them.

Axes: B windows, L frames, F numbers of the network's input.
"""

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np
import torch
from torch.utils.data import DataLoader, Dataset

from tools.temporal.batches import TWELVE, Batch


class TensorBatch(NamedTuple):
    """What the losses need of a batch.

    Attributes:
        numbers: The network's input (B, L, F); half precision, which its noise hides.
        flat: The twelve joints in the image (B, L, 12, 2), metres at the hips' distance.
        depth: The detector's depth of them (B, L, 12), metres.
        truth: Their true places (B, L, 12, 3), metres.
        distance, good, up, contact: As in `Batch`.
    """

    numbers: torch.Tensor
    flat: torch.Tensor
    depth: torch.Tensor
    truth: torch.Tensor
    distance: torch.Tensor
    good: torch.Tensor
    up: torch.Tensor
    contact: torch.Tensor

    def on(self, device: torch.device) -> "TensorBatch":
        """Return the batch on a device."""
        return TensorBatch(*(part.to(device, non_blocking=True) for part in self))


def to_tensors(batch: Batch) -> TensorBatch:
    """Return the tensors of a batch."""

    def tensor(values: np.ndarray) -> torch.Tensor:
        return torch.from_numpy(np.ascontiguousarray(values, np.float32))

    return TensorBatch(
        torch.from_numpy(batch.numbers().astype(np.float16)),
        tensor(batch.flat[:, :, TWELVE]),
        tensor(batch.local[:, :, TWELVE, 2]),
        tensor(batch.truth[:, :, TWELVE]),
        *map(tensor, (batch.distance, batch.good, batch.up, batch.contact)),
    )


class StepDataset(Dataset[TensorBatch]):
    """The batch of each step, the same whoever draws it."""

    def __init__(self, draw: Callable[[int], Batch]) -> None:
        self.draw = draw

    def __getitem__(self, step: int) -> TensorBatch:
        return to_tensors(self.draw(step))


def tensor_batches(
    draw: Callable[[int], Batch], steps: range, workers: int
) -> Iterator[TensorBatch]:
    """Return the batches of steps in order, drawn ahead by a number of processes (0: here)."""
    return iter(
        DataLoader(
            StepDataset(draw),
            batch_size=None,
            sampler=steps,
            num_workers=workers,
            multiprocessing_context="fork" if workers else None,
            pin_memory=torch.cuda.is_available(),
        )
    )
