"""Foot pinning: move the root's path and the legs so that planted feet do not slide.

World frame, metres. First the whole body: the horizontal path of the root that fits the camera's
track and keeps planted points still, by linear least squares over the clip. Then the legs: hip and
knee correct the remaining error (`leg_ik`), as an animator pins a foot.
"""

import numpy as np
from jaxtyping import Float
from pydantic import PositiveInt
from scipy.linalg import solveh_banded

from robojackson.body.feet import stretches
from robojackson.body.skeleton import pair
from robojackson.body.smoothing import lowpass
from robojackson.config import config_dataclass

LEASH_ROUNDS, LEASH_POWER = 3, 6
TUNED_FPS = 30.0
LARGEST_TIP = np.radians(40.0)
TIP_HZ = 6.0


@config_dataclass
class FootPinningConfig:
    """Weights of the root's path; only their ratios matter.

    Attributes:
        track: Standard deviation of the camera's track across and along the ray, metres (y, x).
        slip: Spread of a planted point's step between two frames at 30 frames a second, metres.
        leash_m: Shift along the ray beyond which the track gets an increasing weight, metres.
        wobble: Spread of the path's second difference at 30 frames a second, metres.
        ramp_s: Time of the transition from a planted to a moving foot, seconds.
        fade_s: Time over which the correction of a pinned foot fades when it leaves, seconds.
        reach_m: Largest correction of a pinned foot, metres; the rest of its slide stays.
        rounds: Iterations of contacts, path and pins.
    """

    track: tuple[float, float] = (0.02, 0.20)
    leash_m: float = 0.15
    slip: float = 0.006
    wobble: float = 0.003
    ramp_s: float = 0.1
    fade_s: float = 0.2
    reach_m: float = 0.09
    rounds: PositiveInt = 2


def root_correction(
    feet: Float[np.ndarray, "T 4 3"],
    planted: np.ndarray,
    slope: Float[np.ndarray, " T"],
    fps: float,
    config: FootPinningConfig,
) -> Float[np.ndarray, "T 3"]:
    """Return the horizontal shift of the body that keeps planted points still; z stays zero.

    Minimises over the clip, (x, y) being the shift: the step of planted points over `slip`, second
    differences over `wobble` (both in proportion to the time between frames, and to its square, so
    that every frame rate has the same minimum), x over the camera's spread in depth, and y minus
    x's component along the ray over its spread across: a person who is further away than estimated
    is further aside too, or he would move in the image. A foot that slides along the ray looks
    planted; so where contacts would move the body further than `leash_m` from the track, the track
    dominates.

    Args:
        feet: Foot points, world axes.
        planted: Whether each of them is planted.
        slope: y over x of the ray to the body.
        fps: Frames a second.
        config: Weights.
    """
    trust = np.ones(len(feet))
    shift = _shift(feet, planted, slope, trust, fps, config)
    for _ in range(LEASH_ROUNDS):
        trust = np.maximum(trust, (shift[:, 0] / config.leash_m) ** LEASH_POWER)
        shift = _shift(feet, planted, slope, trust, fps, config)
    return np.concatenate([shift, np.zeros((len(feet), 1))], 1)


def _shift(
    feet: np.ndarray,
    planted: np.ndarray,
    slope: np.ndarray,
    trust: Float[np.ndarray, " T"],
    fps: float,
    config: FootPinningConfig,
) -> Float[np.ndarray, "T 2"]:
    """Return the least squares of `root_correction`; `trust` weighs the depth of the track by
    frame."""
    held = (planted[1:] & planted[:-1]).astype(float)
    step = np.diff(feet, axis=0)[..., :2]
    longer = TUNED_FPS / fps
    slip = config.slip * longer
    hold = held.sum(1) / slip**2
    pull = np.einsum("tk,tka->ta", held, step) / slip**2
    across, along = config.track
    path = path_bands(hold, config.wobble * longer**2)
    bands = np.zeros((5, 2 * len(feet)))
    bands[0::2] = np.repeat(path, 2, axis=1)
    bands[4, 0::2] += trust / along**2 + (slope / across) ** 2
    bands[4, 1::2] += 1.0 / across**2
    bands[3, 1::2] -= slope / across**2
    right = np.zeros((len(feet), 2))
    right[:-1] += pull
    right[1:] -= pull
    return np.asarray(solveh_banded(bands, right.reshape(-1)).reshape(-1, 2))


def path_bands(hold: Float[np.ndarray, " S"], wobble: float) -> Float[np.ndarray, "3 T"]:
    """Return the upper banded matrix of sum hold (ds)^2 + (dds / wobble)^2 over a path s."""
    count = len(hold) + 1
    bands = np.zeros((3, count))
    bands[2, :-1] += hold
    bands[2, 1:] += hold
    bands[1, 1:] -= hold
    if count > 2:
        stiff = 1.0 / wobble**2
        for offset, factor in enumerate((1.0, 4.0, 1.0)):
            bands[2, offset : count - 2 + offset] += factor * stiff
        bands[1, 1 : count - 1] -= 2.0 * stiff
        bands[1, 2:count] -= 2.0 * stiff
        bands[0, 2:] += stiff
    return bands


def pin_offsets(
    feet: Float[np.ndarray, "T 4 3"], planted: np.ndarray, ramp: float
) -> Float[np.ndarray, "T 2 3"]:
    """Return the offsets of the left and the right foot that keep it still while planted.

    In each stretch of contact the foot moves to the mean position of its planted points, the lowest
    of them onto the floor; over `ramp` frames before and after, the correction fades.
    """
    offsets = np.zeros((len(feet), 2, 3))
    for side, points in enumerate(((0, 1), (2, 3))):
        down = planted[:, points]
        target = np.full((len(feet), 3), np.nan)
        for start, end in stretches(np.any(down, axis=1)):
            weight = down[start:end, :, None].astype(float)
            here = feet[start:end, points]
            home = (here * weight).sum(0) / np.maximum(weight.sum(0), 1.0)
            home[..., 2] -= home[down[start:end].any(0), 2].min()
            off = ((home - here) * weight).sum(1) / np.maximum(weight.sum(1), 1.0)
            target[start:end] = off
        offsets[:, side] = faded(target, ramp)
    return offsets


def within_reach(pins: Float[np.ndarray, "T 2 3"], reach: float) -> Float[np.ndarray, "T 2 3"]:
    """Return the pins, none longer than `reach`."""
    longer = np.linalg.norm(pins, axis=-1, keepdims=True)
    return np.asarray(pins * np.minimum(1.0, reach / np.maximum(longer, reach)))


def faded(target: Float[np.ndarray, "T N"], ramp: float) -> Float[np.ndarray, "T N"]:
    """Return values where they are known; elsewhere those of both neighbours, fading to zero.

    Args:
        target: Values, NaN where unknown.
        ramp: Frames over which a value fades.
    """
    known = np.flatnonzero(~np.isnan(target[:, 0]))
    if not len(known):
        return np.zeros_like(target)
    frames = np.arange(len(target))
    after = np.searchsorted(known, frames).clip(max=len(known) - 1)
    before = (np.searchsorted(known, frames, side="right") - 1).clip(min=0)
    shares = []
    for away in (frames - known[before], known[after] - frames):
        part = np.where(away < 0, 0.0, np.clip(1.0 - away / ramp, 0.0, 1.0))
        shares.append((part * part * (3.0 - 2.0 * part))[:, None])
    total = np.maximum(shares[0] + shares[1], 1.0)
    result: np.ndarray = (
        shares[0] * target[known[before]] + shares[1] * target[known[after]]
    ) / total
    return result


def shared_height(
    offsets: Float[np.ndarray, "T 2 3"], planted: np.ndarray
) -> Float[np.ndarray, "T 3"]:
    """Return the vertical offset that the planted feet have in common: the body follows it.

    In a nearly straight leg a centimetre at the foot needs several at the knee; so the knees
    correct only the difference between the feet.
    """
    stands = planted.reshape(-1, 2, 2).any(2).astype(float)
    count = stands.sum(1)
    mean = np.full((len(offsets), 3), np.nan)
    held = count > 0
    mean[held] = 0.0
    mean[held, 2] = (offsets[held, :, 2] * stands[held]).sum(1) / count[held]
    return _bridged(mean)


def tip_angles(
    points: Float[np.ndarray, "T 29 3"],
    feet: Float[np.ndarray, "T 4 3"],
    planted: np.ndarray,
    fps: float,
    ramp: float,
) -> Float[np.ndarray, "T 2"]:
    """Return the pitch of each foot about its ankle that puts a toe without its heel on the floor.

    The detector hardly measures a foot's pitch and measures an ankle well: so a toe in the air is
    an error of the pitch, up to a limit, and only the rest one of the leg. For `feet.turn_feet`.
    """
    angles = np.full((len(feet), 2), np.nan)
    chains = zip(pair("ankle"), pair("big_toe"), strict=True)
    for side, (ankle, toe) in enumerate(chains):
        alone = planted[:, 2 * side + 1] & ~planted[:, 2 * side]
        sole = points[:, toe] - points[:, ankle]
        length = np.linalg.norm(sole, axis=-1)
        goal = sole[:, 2] - feet[:, 2 * side + 1, 2]
        now, then = (np.arcsin(np.clip(z / length, -1.0, 1.0)) for z in (sole[:, 2], goal))
        angles[alone, side] = np.clip(now - then, -LARGEST_TIP, LARGEST_TIP)[alone]
    target = np.concatenate([faded(column[:, None], ramp) for column in angles.T], 1)
    return lowpass(target, fps, TIP_HZ)


def _bridged(target: np.ndarray) -> np.ndarray:
    known = ~np.isnan(target[:, 0])
    if not known.any():
        return np.zeros_like(target)
    time = np.arange(len(target))
    return np.stack([np.interp(time, time[known], column[known]) for column in target.T], -1)
