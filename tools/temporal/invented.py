"""An invented detector: truths without pictures, disturbed as BlazePose disturbs.

What it sees is a linear map of the truth (fitted to the real pairs: it flattens and leans) plus
the residual of a real clip, another one, as it was through time.
"""

from collections.abc import Sequence
from dataclasses import replace

import torch

from tools.temporal.batches import SWAP, Batch, windows
from tools.temporal.examples import Example, body_size
from tools.temporal.random_numbers import RandomNumbers
from tools.temporal.tensors import index_on, numbers_on

RIDGE = 3e-3
STRENGTH = ((0.3, 1.3), (-0.2, 1.3))
"""Share of a residual, and of the map's error, that is added: real people are misjudged in other
ways than rendered ones, so that the map's may be missing or reversed."""


class Detector:
    """The map and the residuals of real examples."""

    def __init__(self, real: Batch, sizes: Sequence[float]) -> None:
        """Fit the map.

        Args:
            real: Whole examples.
            sizes: Size of the person of each (`examples.body_size`).
        """
        good = real.good > 0
        design, errors = _row(real.truth), _errors(real)
        rows, wrong = design[good], errors[good]
        normal = rows.mT @ rows + len(rows) * RIDGE * torch.eye(rows.shape[1], device=rows.device)
        self.map = torch.linalg.solve(normal.double(), (rows.mT @ wrong).double()).float()
        shape = (*real.truth.shape[:3], 5)
        self.residuals = replace(real, truth=(errors - design @ self.map).reshape(shape))
        self.sizes = torch.tensor(sizes, device=rows.device)

    def see(self, batch: Batch, rng: RandomNumbers) -> Batch:
        """Return windows of an exact detector with this one's errors: the map's and those of a
        real clip, mirrored as often as not, each more or less strongly, and its visibility."""
        count, frames = batch.good.shape
        rows = rng.integers(len(self.residuals.good), count)
        drawn = windows(self.residuals, rows, frames, rng)
        mirror = rng.chance(0.5, count)[:, None, None]
        flip = numbers_on(rng.device, -1.0, 1.0, 1.0, -1.0, 1.0)
        swap = index_on(rng.device, *SWAP)
        errors = torch.where(mirror[..., None], drawn.truth[:, :, swap] * flip, drawn.truth)
        seen = torch.where(mirror, drawn.visibility[:, :, swap], drawn.visibility)
        mapped = (_row(batch.truth) @ self.map).reshape(errors.shape)
        own, general = (rng.uniform(*ends, count, 1, 1, 1) for ends in STRENGTH)
        errors = own * errors + general * mapped
        local, flat = batch.local + errors[..., :3], batch.flat + errors[..., 3:]
        return replace(batch, local=local, flat=flat, visibility=seen)


def sizes_of(examples: Sequence[Example]) -> list[float]:
    """Return the size of the person of each example."""
    return [body_size(example.truth) for example in examples]


def _row(truth: torch.Tensor) -> torch.Tensor:
    flat = truth.flatten(-2)
    return torch.cat([flat, torch.ones_like(flat[..., :1])], -1)


def _errors(real: Batch) -> torch.Tensor:
    """Return the errors of depth and image of what was detected, (B, T, 5 N)."""
    away = real.distance[..., None, None]
    ideal = real.truth[..., :2] * away / (away + real.truth[..., 2:])
    return torch.cat([real.local - real.truth, real.flat - ideal], -1).flatten(2)
