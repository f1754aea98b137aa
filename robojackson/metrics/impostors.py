"""Impostors: motions that do not dance, against which every headline figure is tried.

A headline figure has to rank each of them below an honest estimate (`honest`): the truth plus an
error that is as smooth as a motion and 20 mm long in the mean. Metres, seconds, z up.
"""

from collections.abc import Callable, Mapping, Sequence
from functools import partial

import numpy as np
from jaxtyping import Float

from robojackson.body.smoothing import lowpass

Motion = Float[np.ndarray, "T J 3"]
Impostor = Callable[[np.ndarray, float], np.ndarray]
HONEST_ERROR_M, HONEST_HZ = 0.02, 1.0
LAG_S = 0.2
FLAIL_M, FLAIL_HZ = 0.2, 3.0
JUMP_M = 1.0


def frozen_first(truth: Motion, fps: float) -> Motion:
    """Return the first pose, held forever."""
    return np.repeat(truth[:1], len(truth), axis=0)


def mean_pose(truth: Motion, fps: float) -> Motion:
    """Return the mean pose, held forever."""
    return np.repeat(truth.mean(0, keepdims=True), len(truth), axis=0)


def half_amplitude(truth: Motion, fps: float) -> Motion:
    """Return the right motion, half as large."""
    mean = truth.mean(0, keepdims=True)
    result: Motion = mean + (truth - mean) / 2.0
    return result


def late(truth: Motion, fps: float) -> Motion:
    """Return the right motion, 200 ms late."""
    frames = np.arange(len(truth)) - round(LAG_S * fps)
    return truth[np.maximum(frames, 0)]


def mirrored(truth: Motion, fps: float, sides: Sequence[tuple[int, int]]) -> Motion:
    """Return left exchanged for right, at the same place and with the same mean heading.

    Args:
        sides: Left and right joint of each pair; the first pair, the hips, gives the heading.
    """
    left, right = sides[0]
    across = (truth[:, left] - truth[:, right]).mean(0) * [1.0, 1.0, 0.0]
    across = across / max(float(np.linalg.norm(across)), 1e-9)
    middle = truth.mean((0, 1))
    side = (truth - middle) @ across
    swapped = truth - 2.0 * side[..., None] * across
    order = np.arange(truth.shape[1])
    for a, b in sides:
        order[[a, b]] = order[[b, a]]
    result: Motion = swapped[:, order]
    return result


def flailing(truth: Motion, fps: float, rng: np.random.Generator) -> Motion:
    """Return each joint moving randomly about its mean place."""
    result: Motion = truth.mean(0, keepdims=True) + wander(truth.shape, fps, FLAIL_M, FLAIL_HZ, rng)
    return result


def teleported(truth: Motion, fps: float) -> Motion:
    """Return the right motion that jumps by a metre half way."""
    moved = np.array(truth)
    moved[len(truth) // 2 :] += [JUMP_M, 0.0, 0.0]
    return moved


def honest(
    truth: Motion, fps: float, rng: np.random.Generator, size_m: float = HONEST_ERROR_M
) -> Motion:
    """Return a good estimate: the truth plus a smooth error of 20 mm in the mean."""
    result: Motion = truth + wander(truth.shape, fps, size_m, HONEST_HZ, rng)
    return result


def wander(
    shape: tuple[int, ...], fps: float, size_m: float, cutoff_hz: float, rng: np.random.Generator
) -> Motion:
    """Smooth noise whose mean length is `size_m`."""
    noise = lowpass(rng.normal(size=shape), fps, cutoff_hz)
    result: Motion = noise * size_m / np.linalg.norm(noise, axis=-1).mean()
    return result


def impostors(sides: Sequence[tuple[int, int]], rng: np.random.Generator) -> Mapping[str, Impostor]:
    """Return all seven by name: (truth, fps) -> motion."""
    return {
        "frozen_first": frozen_first,
        "mean_pose": mean_pose,
        "half_amplitude": half_amplitude,
        "late": late,
        "mirrored": partial(mirrored, sides=sides),
        "flailing": partial(flailing, rng=rng),
        "teleported": teleported,
    }
