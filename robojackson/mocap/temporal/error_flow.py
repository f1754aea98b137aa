"""An invertible network between the lifter's error and its embedding z, as in NIKI (Li et al., CVPR
2023): z is 0 for a clean clip, standard normal and independent of the pose otherwise.

Affine couplings (RealNVP, Dinh et al. 2017) over the 36 coordinates of a frame's error divided by
the spread, conditioned on the lifter's features. Through time z is an AR(1) process.
"""

from collections.abc import Mapping

import numpy as np
from jaxtyping import Float

SIZE = 36
LAYERS = 6
HIDDEN = 96
CONDITION = 48
Weights = Mapping[str, np.ndarray]
"""Arrays by the names of the weights file."""


def mask_of(layer: int) -> Float[np.ndarray, " D"]:
    """Return the coordinates that a layer does not change: every other joint, then the rest."""
    return ((np.arange(SIZE) // 3 + layer) % 2).astype(float)


def to_embedding(
    error: Float[np.ndarray, "*T D"], features: Float[np.ndarray, "*T C"], weights: Weights
) -> Float[np.ndarray, "*T D"]:
    """Return z from error over spread."""
    condition = _condition(features, weights)
    x = np.asarray(error, float)
    for layer in range(LAYERS):
        kept = mask_of(layer)
        scale, shift = _nets(x * kept, condition, layer, weights)
        x = x * kept + (1.0 - kept) * (x * np.exp(scale) + shift)
    return x


def to_error(
    embedding: Float[np.ndarray, "*T D"], features: Float[np.ndarray, "*T C"], weights: Weights
) -> Float[np.ndarray, "*T D"]:
    """Return error over spread from z: the exact inverse."""
    condition = _condition(features, weights)
    x = np.asarray(embedding, float)
    for layer in reversed(range(LAYERS)):
        kept = mask_of(layer)
        scale, shift = _nets(x * kept, condition, layer, weights)
        x = x * kept + (1.0 - kept) * (x - shift) * np.exp(-scale)
    return x


def sample(count: int, weights: Weights, rng: np.random.Generator) -> Float[np.ndarray, "T D"]:
    """Return a stationary AR(1) sample of z."""
    memory = 1.0 / (1.0 + np.exp(-weights["flow.memory"].astype(float)))
    fresh = rng.normal(size=(count, SIZE))
    z = np.empty_like(fresh)
    z[0] = fresh[0]
    for frame in range(1, count):
        z[frame] = memory * z[frame - 1] + np.sqrt(1.0 - memory**2) * fresh[frame]
    return z


def _condition(features: np.ndarray, weights: Weights) -> np.ndarray:
    result: np.ndarray = np.maximum(
        features @ weights["flow.read.weight"].T + weights["flow.read.bias"], 0.0
    )
    return result


def _nets(
    x: np.ndarray, condition: np.ndarray, layer: int, weights: Weights
) -> tuple[np.ndarray, np.ndarray]:
    """Return log scale, within +-1.5, and shift."""
    name = f"flow.couplings.{layer}"
    joined = np.concatenate([x, condition], -1)
    hidden = np.maximum(joined @ weights[f"{name}.0.weight"].T + weights[f"{name}.0.bias"], 0.0)
    out = hidden @ weights[f"{name}.2.weight"].T + weights[f"{name}.2.bias"]
    return 1.5 * np.tanh(out[..., :SIZE]), out[..., SIZE:]
