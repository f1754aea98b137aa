"""An invented detector: truths without pictures, disturbed as BlazePose disturbs.

What it sees is a linear map of the truth (fitted to the real pairs: it flattens and leans) plus
the residual of a real clip, another one, as it was through time.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from robojackson.mocap.temporal.features import INPUT_LANDMARKS, ClipView
from tools.temporal.batches import SWAP, Batch, windows
from tools.temporal.examples import Example, Truth, body_size, flattened

RIDGE = 3e-3
TILT_DEG = (8.0, 13.0)
"""Mean and standard deviation by which the camera looks down more than in the truth."""
STRENGTH = (0.8, 1.2)
"""Share of a residual that is added."""


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

    def sees(self, truth: Truth, rng: np.random.Generator) -> Example:
        """Return what it would see of a truth, but for the residual."""
        points, distance, wrong_focal = truth
        tilt = Rotation.from_euler("x", rng.normal(*TILT_DEG), degrees=True).as_matrix()
        points = points @ tilt.T
        scale = self.sizes[rng.integers(len(self.sizes))] / body_size(points)
        points, distance = points * scale, distance * scale
        count = len(points)
        mapped = (_row(points[:, INPUT_LANDMARKS]) @ self.map).reshape(
            count, len(INPUT_LANDMARKS), 5
        )
        sight = ClipView(
            flat=np.zeros((count, 33, 2)),
            local=np.zeros((count, 33, 3)),
            visibility=np.ones((count, 33)),
            axes=np.tile(np.eye(3), (count, 1, 1)),
            root=np.outer(distance * wrong_focal, [0.0, 0.0, 1.0]),
        )
        sight.local[:, INPUT_LANDMARKS] = points[:, INPUT_LANDMARKS] + mapped[..., :3]
        sight.flat[:, INPUT_LANDMARKS] = (
            flattened(points, distance)[:, INPUT_LANDMARKS] + mapped[..., 3:]
        )
        return Example(sight, points, np.ones(count, bool), distance, "invented")

    def disturb(self, batch: Batch, rng: np.random.Generator) -> Batch:
        """Add residuals, mirrored as often as not, and take over their visibility."""
        count, frames = batch.good.shape
        rows = np.asarray(rng.integers(0, len(self.residuals.good), count))
        drawn = windows(self.residuals, rows, frames, rng)
        strength = rng.uniform(*STRENGTH, (count, 1, 1, 1)).astype(np.float32)
        mirror = np.asarray(rng.uniform(size=count) < 0.5)[:, None, None, None]
        flip = np.array([-1.0, 1.0, 1.0, -1.0, 1.0], np.float32)
        errors = strength * np.where(mirror, drawn.truth[:, :, SWAP] * flip, drawn.truth)
        seen = np.where(mirror[..., 0], drawn.visibility[:, :, SWAP], drawn.visibility)
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
