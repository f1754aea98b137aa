"""How a motion meets the beats of music: precision, recall, F1 and the beat alignment score.

A beat of a motion is a local minimum of the mean speed of its points, as in AI Choreographer (Li et
al., ICCV 2021). BAS = mean over the beats of the music of exp(-d^2 / 2 sigma^2), d the time to the
nearest beat of the motion. A body that jitters has many beats and so a high BAS: precision shows
it. Seconds.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.ndimage import gaussian_filter1d
from scipy.signal import find_peaks

NEAR_S = 0.1
"""A beat of the motion within this of one of the music hits it."""
SIGMA_S = 0.05
"""Of BAS: 3 frames at 60 a second."""
SMOOTHING_S = 0.06
"""Standard deviation of the filter over the speed."""
PROMINENCE = 0.1
"""How far the speed rises around a beat, of its spread (90th less 10th percentile)."""


@dataclass(frozen=True)
class BeatAlignment:
    """Figures of one motion beside one piece of music.

    Attributes:
        beats: Beats of the motion, seconds.
        precision: Share of them that hit a beat of the music.
        recall: Share of the music's beats that are hit.
        f1: Harmonic mean of the two.
        bas: Beat alignment score, 0..1.
    """

    beats: int
    precision: float
    recall: float
    f1: float
    bas: float


def motion_beats(points: Float[np.ndarray, "T K 3"], fps: float) -> Float[np.ndarray, " B"]:
    """Return the times at which the mean speed of the points is least."""
    if len(points) < 3:
        return np.zeros(0)
    speed = np.linalg.norm(np.gradient(points, 1 / fps, axis=0), axis=-1).mean(1)
    smooth = gaussian_filter1d(speed, SMOOTHING_S * fps)
    spread = float(np.ptp(np.percentile(smooth, [10, 90])))
    found, _ = find_peaks(-smooth, prominence=max(PROMINENCE * spread, 1e-9))
    times: np.ndarray = found / fps
    return times


def alignment(music: Float[np.ndarray, " M"], motion: Float[np.ndarray, " B"]) -> BeatAlignment:
    """Compare the beats of a motion with those of music; each beat counts once."""
    if not len(music) or not len(motion):
        return BeatAlignment(len(motion), 0.0, 0.0, 0.0, 0.0)
    hits = _hits(np.sort(music), np.sort(motion))
    precision, recall = hits / len(motion), hits / len(music)
    nearest = np.abs(music[:, None] - motion[None]).min(1)
    bas = float(np.exp(-(nearest**2) / (2 * SIGMA_S**2)).mean())
    f1 = 2 * precision * recall / (precision + recall) if hits else 0.0
    return BeatAlignment(len(motion), precision, recall, f1, bas)


def half_a_beat(music: Float[np.ndarray, " M"]) -> float:
    """Return the shift of the control: half of the usual time between beats, seconds."""
    return float(np.median(np.diff(music))) / 2 if len(music) > 1 else 0.0


def _hits(music: np.ndarray, motion: np.ndarray) -> int:
    """Count the pairs that lie near each other, each beat in one: earliest first."""
    hits = i = j = 0
    while i < len(music) and j < len(motion):
        apart = motion[j] - music[i]
        if abs(apart) <= NEAR_S:
            hits, i, j = hits + 1, i + 1, j + 1
        elif apart < 0:
            j += 1
        else:
            i += 1
    return hits
