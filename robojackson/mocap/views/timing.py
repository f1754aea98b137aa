"""Start of one clip in the time of another, from the sound or from the person's motion.

The distances between joints change equally for every camera: their rates of change, from each
clip's own landmarks, are correlated at every offset. Sounds are correlated by the rises of their
loudness. Seconds.
"""

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from jaxtyping import Float
from scipy.signal import correlate, find_peaks

from robojackson.body.smoothing import lowpass
from robojackson.clips.sound import RATE, Sound
from robojackson.mocap.landmarks.blazepose import landmark

FPS = 60.0
SMOOTH_HZ = 4.0
CANDIDATES = 4
SOUND_FPS = 210.0
CLEAR = 1.5
"""Factor by which two sounds must agree better than at any other offset; otherwise the motion is
used."""
SHORTEST_S = 1.0
"""Least overlap of both clips, seconds."""
POINTS = [
    landmark(f"{side}_{name}")
    for name in ("wrist", "elbow", "shoulder", "hip", "knee", "ankle")
    for side in ("left", "right")
]


@dataclass(frozen=True)
class Offset:
    """Start of a second clip.

    Attributes:
        seconds: Time of its first frame in the first clip.
        correlation: Correlation of both motions at that offset, -1..1.
    """

    seconds: float
    correlation: float


def rates(
    local: Float[np.ndarray, "T 33 3"], times: Float[np.ndarray, " T"]
) -> Float[np.ndarray, "S P"]:
    """Return the rates of change of the distances between joints on a grid of `FPS`, metres a
    second."""
    pairs = np.array(list(combinations(POINTS, 2)))
    apart = np.linalg.norm(local[:, pairs[:, 0]] - local[:, pairs[:, 1]], axis=-1)
    grid = np.arange(times[0], times[-1], 1.0 / FPS)
    if len(grid) < 2:  # refused later, for what two clips have in common
        grid = times[0] + np.arange(2) / FPS
    even = np.stack([np.interp(grid, times, column) for column in apart.T], -1)
    return np.asarray(np.gradient(lowpass(even, FPS, SMOOTH_HZ), axis=0) * FPS)


def find_offsets(first: Float[np.ndarray, "S P"], second: Float[np.ndarray, "R P"]) -> list[Offset]:
    """Return the offsets of best agreement of two courses of `rates`, the best first, to sub-frame
    accuracy."""
    least = min(round(SHORTEST_S * FPS), len(first), len(second))
    shifts = np.arange(least - len(second), len(first) - least + 1)
    found = np.array([_agreement(first, second, int(shift)) for shift in shifts])
    peaks, _ = find_peaks(np.pad(found, 1, constant_values=-1.0), distance=FPS / SMOOTH_HZ / 2.0)
    best = sorted(peaks - 1, key=lambda peak: -found[peak])[:CANDIDATES]
    return [Offset(float(shifts[k] + _part(found, k)) / FPS, float(found[k])) for k in best]


def sound_offset(first: Sound, second: Sound) -> float | None:
    """Return when the second sound began in the first; None where no offset stands out."""
    one, two = (_rises(sound) for sound in (first, second))
    if min(len(one), len(two)) < SHORTEST_S * SOUND_FPS:
        return None
    found = correlate(one, two, "full")
    shifts = np.arange(1 - len(two), len(one))
    best = int(found.argmax())
    rivals = found[np.abs(shifts - shifts[best]) > SOUND_FPS / SMOOTH_HZ]
    if not len(rivals) or found[best] < CLEAR * rivals.max(initial=0.0):
        return None
    return float(shifts[best] + _part(found, best)) / SOUND_FPS


def _rises(sound: Sound) -> Float[np.ndarray, " S"]:
    """Return the increase of the logarithm of the loudness, `SOUND_FPS` values a second, mean
    zero."""
    hop = RATE // int(SOUND_FPS)
    count = len(sound.samples) // hop
    power = (sound.samples[: count * hop].mean(1) ** 2).reshape(count, hop).mean(1)
    rises = np.maximum(np.diff(np.log(power + 1e-8)), 0.0)
    return np.asarray(rises - rises.mean())


def _part(values: np.ndarray, peak: int) -> float:
    """Return the sub-frame position of the vertex of the parabola through a peak and its
    neighbours."""
    if not 0 < peak < len(values) - 1:
        return 0.0
    before, here, after = values[peak - 1 : peak + 2]
    return float(0.5 * (before - after) / min(before - 2.0 * here + after, -1e-12))


def _agreement(first: np.ndarray, second: np.ndarray, shift: int) -> float:
    """Return the correlation of the common frames if the second clip begins at frame `shift`."""
    start, end = max(shift, 0), min(len(first), len(second) + shift)
    one, two = first[start:end], second[start - shift : end - shift]
    size = np.sqrt((one**2).sum() * (two**2).sum())
    return float((one * two).sum() / max(size, 1e-12))
