"""An invented detector: truths without pictures, disturbed as BlazePose disturbs.

What it sees is a linear map of the truth (fitted to the real pairs: it flattens and leans) plus
the residual of a real clip, another one, as it was through time.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from tools.temporal.batches import SWAP, Batch, windows
from tools.temporal.examples import Example, body_size

RIDGE = 3e-3
STRENGTH = ((0.3, 1.3), (-0.2, 1.3))
"""Share of a residual, and of the map's error, that is added: real people are misjudged in other
ways than rendered ones, so that the map's may be missing or reversed."""


class Detector:
    """The map and the residuals of real examples."""

    def __init__(self, real: Batch, examples: Sequence[Example]) -> None:
        good = real.good > 0
        design, errors = _row(real.truth), _errors(real)
        rows, wrong = design[good], errors[good]
        normal = rows.T @ rows + len(rows) * RIDGE * np.eye(rows.shape[1])
        self.map = np.linalg.solve(normal, rows.T @ wrong).astype(np.float32)
        shape = (*real.truth.shape[:3], 5)
        self.residuals = replace(real, truth=(errors - design @ self.map).reshape(shape))
        self.sizes = [body_size(e.truth) for e in examples]

    def see(self, batch: Batch, rng: np.random.Generator) -> Batch:
        """Return windows of an exact detector with this one's errors: the map's and those of a
        real clip, mirrored as often as not, each more or less strongly, and its visibility."""
        count, frames = batch.good.shape
        rows = np.asarray(rng.integers(0, len(self.residuals.good), count))
        drawn = windows(self.residuals, rows, frames, rng)
        mirror = np.asarray(rng.uniform(size=count) < 0.5)[:, None, None, None]
        flip = np.array([-1.0, 1.0, 1.0, -1.0, 1.0], np.float32)
        errors = np.where(mirror, drawn.truth[:, :, SWAP] * flip, drawn.truth)
        seen = np.where(mirror[..., 0], drawn.visibility[:, :, SWAP], drawn.visibility)
        mapped = (_row(batch.truth) @ self.map).reshape(errors.shape)
        strength = [rng.uniform(*ends, (count, 1, 1, 1)).astype(np.float32) for ends in STRENGTH]
        errors = strength[0] * errors + strength[1] * mapped
        local, flat = batch.local + errors[..., :3], batch.flat + errors[..., 3:]
        return replace(batch, local=local, flat=flat, visibility=seen)


def _row(truth: np.ndarray) -> np.ndarray:
    flat = truth.reshape(*truth.shape[:-2], -1)
    return np.concatenate([flat, np.ones((*flat.shape[:-1], 1))], -1).astype(np.float32)


def _errors(real: Batch) -> np.ndarray:
    """Return the errors of depth and image of what was detected, (B, T, 5 N)."""
    away = real.distance[..., None, None]
    ideal = real.truth[..., :2] * away / (away + real.truth[..., 2:])
    errors = np.concatenate([real.local - real.truth, real.flat - ideal], -1)
    return errors.reshape(*errors.shape[:2], -1)
