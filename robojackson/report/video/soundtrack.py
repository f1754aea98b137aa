"""Sound at the tempo of a dance: slowed or warped with its pitch kept.

Waveform similarity overlap-add (Verhelst and Roelands, 1993): every 20 ms of the result are taken
from the motion's place in the clip, within 6 ms, where they best continue the sound before.
FFmpeg's atempo has one tempo for a whole track and drifts; here no moment is further from its
picture than the width of the search. Seconds.
"""

from pathlib import Path

import numpy as np
from jaxtyping import Float

from robojackson.clips.sound import RATE, Sound, read_sound, require_sound
from robojackson.motion.reference_motion import ReferenceMotion

HOP = round(0.02 * RATE)
SEARCH = round(0.006 * RATE)
COARSE = 4
"""Stride of the samples that are compared in the search."""


def soundtrack(
    source: Path | None, music: str, reference: ReferenceMotion | None, seconds: float
) -> Sound | None:
    """Return the sound of a film of a motion; None where it is silent.

    A cyclic motion repeats the sound of its clip with the clip; music continues.

    Args:
        source: The clip.
        music: Path of other music, or empty.
        reference: The motion; None plays the sound unchanged.
        seconds: Length of the film.
    Raises:
        UnreadableVideo: the music cannot be read, or has no sound.
    """
    sound = require_sound(Path(music)) if music else source and read_sound(source)
    if not sound:
        return None
    times = np.arange(0, seconds, HOP / RATE)
    if reference is not None:
        times = clip_times(reference, times, goes_on=bool(music))
    return Sound(warped(sound.samples, times)[: round(seconds * RATE)])


def clip_times(
    reference: ReferenceMotion, times: Float[np.ndarray, " N"], goes_on: bool = False
) -> Float[np.ndarray, " N"]:
    """Return the time of the clip at every time of the motion.

    Args:
        goes_on: Whether the clip's time continues in the next cycle instead of starting again.
    """
    known = np.asarray(reference.source_time_s, float)
    known = np.append(known, 2 * known[-1] - known[-2])
    cycle, elapsed = np.zeros_like(times), times / reference.dt
    if reference.cyclic:
        cycle, elapsed = np.divmod(elapsed + 1e-9, len(reference))
    found: np.ndarray = np.interp(elapsed, np.arange(len(known)), known)
    return found + cycle * (known[-1] - known[0]) if goes_on else found


def warped(
    samples: Float[np.ndarray, "S C"], times: Float[np.ndarray, " N"]
) -> Float[np.ndarray, "T C"]:
    """Return the sound whose every `HOP` samples come from one time of it; silence where it pauses.

    Args:
        times: Times of the sound, at every hop of the result.
    """
    reach = 2 * HOP
    inside = np.pad(samples, ((SEARCH + reach, 2 * SEARCH + 2 * reach), (0, 0)))
    mono = inside.mean(1)
    window = np.hanning(reach + 1)[:-1, None]
    out = np.zeros((len(times) * HOP + reach, samples.shape[1]), np.float32)
    steps = np.diff(times)
    stands = np.append(steps, steps[-1] if len(steps) else 1.0) == 0
    places = np.round(times * RATE).astype(int) + reach + SEARCH - HOP
    last = -1
    for index, place in enumerate(places):
        place = int(np.clip(place, SEARCH, len(inside) - reach - SEARCH - 1))
        if last >= 0 and place != last + HOP:
            place += _shift(mono, place, last + HOP, reach)
        if not stands[index]:
            out[index * HOP : index * HOP + reach] += window * inside[place : place + reach]
        last = min(place, len(inside) - reach - HOP - SEARCH - 1)
    return out[HOP : HOP + len(times) * HOP]


def _shift(mono: Float[np.ndarray, " S"], place: int, continued: int, reach: int) -> int:
    """Return the offset by which a piece best continues another."""
    target = mono[continued : continued + reach : COARSE]
    near = mono[place - SEARCH : place + SEARCH + reach : COARSE]
    score = np.correlate(near, target, "valid")
    energy = np.convolve(near**2, np.ones(len(target)), "valid")
    best = int(np.argmax(score / np.sqrt(energy + 1e-9)))
    return best * COARSE - SEARCH if score[best] > 0 else 0
