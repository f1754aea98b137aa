"""Detect flight of a body: free fall, and jumps from the last to the first contact. World z up;
metres."""

import math

import numpy as np
from jaxtyping import Float

from robojackson.body.feet import stretches
from robojackson.body.smoothing import lowpass
from robojackson.mocap.grounding.floor import GRAVITY

FALL_CUTOFF_HZ = 6.0
SHORTEST_FALL_S = 0.1
FALL_SHARE = 0.35
"""Least mean acceleration of a whole flight, in multiples of gravity."""
FLIGHT_EDGE_S = 0.15
"""Part of a free fall's beginning and end that smoothing hides, seconds; so does it at both ends of
a clip, where its odd reflection makes the acceleration zero."""
FLIGHT_MARGIN_S, RISE_SHARE = 0.07, 0.45
"""Corrections of a jump: the time that the change of sign misses at either end, and the least rise
of the feet, as a share of that of a body in the air for as long."""


def free_fall(height: Float[np.ndarray, " T"], fps: float, cut: bool = False) -> np.ndarray:
    """Return the frames in which the pelvis falls freely: its acceleration is below -g / 2 for a
    while.

    Args:
        height: Height of the pelvis, metres.
        fps: Frames a second.
        cut: Whether a fall near an end of the clip continues to it.
    """
    if len(height) < 5:
        return np.zeros(len(height), bool)
    acceleration = np.gradient(np.gradient(lowpass(height, fps, FALL_CUTOFF_HZ))) * fps**2
    falling = acceleration < -GRAVITY / 2.0
    if cut:
        falling = _to_ends(falling, acceleration, fps)
    for start, end in stretches(falling):
        if (end - start) / fps < SHORTEST_FALL_S:
            falling[start:end] = False
    result: np.ndarray = falling
    return result


def _to_ends(falling: np.ndarray, acceleration: Float[np.ndarray, " T"], fps: float) -> np.ndarray:
    """Return a fall with the part that smoothing hides at an end of the clip: there the body still
    accelerates downward, where a landing would accelerate it upward."""
    edge, found = round(FLIGHT_EDGE_S * fps), np.array(falling)
    for way in (slice(None), slice(None, None, -1)):
        first = int(found[way].argmax())
        if found.any() and first <= edge and (acceleration[way][:first] < 0.0).all():
            found[way][:first] = True
    return found


def ballistic(
    height: Float[np.ndarray, " T"], lowest: Float[np.ndarray, " T"], fps: float
) -> np.ndarray:
    """Return the frames of jumps: the body falls freely, and the feet rise as far as its fall
    implies.

    Push-off and landing accelerate upward, so that a flight lasts from one change of sign of the
    acceleration to the next, whatever the smoothing. Of a clip that is cut in the air, only the
    other end of the flight shows the ground.

    Args:
        height: Height of the centre of mass, metres; any level.
        lowest: Height of the lowest foot point, metres; any level.
        fps: Frames a second.
    """
    falling = free_fall(height, fps, cut=True)
    flying = np.zeros(len(height), bool)
    if not falling.any():
        return flying
    acceleration = np.gradient(np.gradient(lowpass(height, fps, FALL_CUTOFF_HZ)))
    frames, margin = np.arange(len(height)), FLIGHT_MARGIN_S * fps
    for start, end in stretches(acceleration < 0.0):
        if not falling[start:end].any():
            continue
        left = _zero_before(acceleration, start) - margin
        landed = _zero_before(acceleration, end) + margin
        ground = np.interp([left, landed], frames, lowest)[_shown(falling, start, end)].max()
        rise = GRAVITY / 8.0 * ((landed - left) / fps) ** 2
        inside = slice(max(math.ceil(left), 0), math.floor(landed) + 1)
        if lowest[inside].max() - ground > RISE_SHARE * rise:
            flying[inside] = True
    return flying


def _shown(falling: np.ndarray, start: int, end: int) -> list[bool]:
    """Return whether the clip shows the take-off and the landing of a flight; of neither, both
    count."""
    shown = [start > 0 or not falling[0], end < len(falling) or not falling[-1]]
    return shown if any(shown) else [True, True]


def _zero_before(values: Float[np.ndarray, " T"], frame: int) -> float:
    """Return where a line through a frame and the one before it is zero, in frames; a jump's time
    enters its rise squared, so that whole frames would decide by the frame rate."""
    if not 0 < frame < len(values):
        return frame - 0.5
    before, after = values[frame - 1], values[frame]
    return float(frame - 1 + before / (before - after))


def flight(
    lowest: Float[np.ndarray, " T"],
    height: Float[np.ndarray, " T"],
    falling: np.ndarray,
    fps: float,
) -> np.ndarray:
    """Return free fall and the frames around it in which the feet still rise or have not yet
    landed.

    Smoothing spreads the push-off and the landing into the fall, so that only its middle is
    detected. It cannot change the mean: a flight grows only while its mean acceleration is that of
    a fall.

    Args:
        lowest: Height of the lowest foot point, metres; any level.
        height: Height of the centre of mass, metres; any level.
        falling: Frames of free fall.
        fps: Frames a second.
    """
    most = round(FLIGHT_EDGE_S * fps)
    speed = np.gradient(height) * fps
    flying = np.array(falling, bool)

    def falls(start: int, end: int) -> bool:
        duration = (end - 1 - start) / fps
        return bool(speed[end - 1] - speed[start] < -FALL_SHARE * GRAVITY * duration)

    for start, end in stretches(flying):
        first, last = max(start - most, 0), min(end + most, len(lowest))
        while start > first and lowest[start - 1] < lowest[start] and falls(start - 1, end):
            start -= 1
        while end < last and lowest[end] < lowest[end - 1] and falls(start, end + 1):
            end += 1
        flying[start + 1 : end - 1] = True
    return flying
