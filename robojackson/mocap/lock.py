"""Feet that stand do not slide: the root's path and the legs are moved until they hold still.

World frame, metres. First the whole body: the horizontal path of the root that fits the camera's
track and keeps planted points still, by linear least squares over the clip. Then the legs: what is
left is taken up by hip and knee, as an animator pins a foot.
"""

import numpy as np
from jaxtyping import Float
from pydantic import ConfigDict, PositiveInt
from pydantic.dataclasses import dataclass
from scipy.linalg import solveh_banded

from robojackson.mocap.feet import stretches
from robojackson.mocap.kinematics import any_normal, unit
from robojackson.mocap.skeleton import pair


@dataclass(frozen=True, config=ConfigDict(extra="forbid"))
class LockConfig:
    """Weights of the root's path; only their ratios matter.

    Attributes:
        track: Standard deviation of the camera's track across and along its axis, metres (y, x).
        slip: Of a planted point's step between two frames, metres.
        wobble: Of the path's second difference at 30 frames a second, metres.
        ramp_s: Time over which a standing foot goes over to a moving one, seconds.
        rounds: How often contacts, path and pins are found anew.
    """

    track: tuple[float, float] = (0.05, 0.30)
    slip: float = 0.001
    wobble: float = 0.003
    ramp_s: float = 0.1
    rounds: PositiveInt = 2


def root_correction(
    feet: Float[np.ndarray, "T 4 3"], planted: np.ndarray, fps: float, config: LockConfig
) -> Float[np.ndarray, "T 3"]:
    """Horizontal shift of the body, so that planted points keep their place; z stays zero."""
    shift = np.zeros((len(feet), 3))
    held = (planted[1:] & planted[:-1]).astype(float)
    step = np.diff(feet, axis=0)
    for axis, spread in ((0, config.track[1]), (1, config.track[0])):
        hold = held.sum(1) / config.slip**2
        pull = (held * step[..., axis]).sum(1) / config.slip**2
        shift[:, axis] = _smoothest(hold, pull, spread, config.wobble * (30.0 / fps) ** 2)
    return shift


def _smoothest(
    hold: np.ndarray, pull: np.ndarray, spread: float, wobble: float
) -> Float[np.ndarray, " T"]:
    """argmin_s sum s^2/spread^2 + hold (ds + pull/hold)^2 + (dds/wobble)^2: a banded system."""
    count = len(hold) + 1
    bands = np.zeros((3, count))
    bands[2] = 1.0 / spread**2
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
    right = np.zeros(count)
    right[:-1] += pull
    right[1:] -= pull
    return solveh_banded(bands, right)


def pin_offsets(
    feet: Float[np.ndarray, "T 4 3"], planted: np.ndarray
) -> Float[np.ndarray, "T 2 3"]:
    """How far to move the left and the right foot so that it stands still while planted.

    In each stretch of contact the foot goes to the mean place of its planted points, the lowest of
    them onto the floor; between two stretches the correction goes from one to the next in a
    straight line.
    """
    offsets = np.zeros((len(feet), 2, 3))
    for side, points in enumerate(((0, 1), (2, 3))):
        down = planted[:, points]
        wanted = np.full((len(feet), 3), np.nan)
        for start, end in stretches(np.any(down, axis=1)):
            weight = down[start:end, :, None].astype(float)
            here = feet[start:end, points]
            home = (here * weight).sum(0) / np.maximum(weight.sum(0), 1.0)
            home[..., 2] -= home[down[start:end].any(0), 2].min()
            off = ((home - here) * weight).sum(1) / np.maximum(weight.sum(1), 1.0)
            wanted[start:end] = off
        offsets[:, side] = _bridged(wanted)
    return offsets


def shared_height(
    offsets: Float[np.ndarray, "T 2 3"], planted: np.ndarray
) -> Float[np.ndarray, "T 3"]:
    """The vertical offset that the standing feet have in common: the body follows it.

    A leg that is nearly straight answers a centimetre at the foot with several at the knee; so only
    the difference between the feet is left to the knees.
    """
    stands = planted.reshape(-1, 2, 2).any(2).astype(float)
    count = stands.sum(1)
    mean = np.full((len(offsets), 3), np.nan)
    held = count > 0
    mean[held] = 0.0
    mean[held, 2] = (offsets[held, :, 2] * stands[held]).sum(1) / count[held]
    return _bridged(mean)


def lift_offsets(feet: Float[np.ndarray, "T 4 3"]) -> Float[np.ndarray, "T 2 3"]:
    """How far to raise each foot so that neither its heel nor its toe is under the floor."""
    lowest = feet[..., 2].reshape(-1, 2, 2).min(2)
    return np.maximum(-lowest, 0.0)[..., None] * np.array([0.0, 0.0, 1.0])


def _bridged(wanted: np.ndarray) -> np.ndarray:
    known = ~np.isnan(wanted[:, 0])
    if not known.any():
        return np.zeros_like(wanted)
    time = np.arange(len(wanted))
    return np.stack([np.interp(time, time[known], column[known]) for column in wanted.T], -1)


def move_feet(
    points: Float[np.ndarray, "T 29 3"], offsets: Float[np.ndarray, "T 2 3"]
) -> Float[np.ndarray, "T 29 3"]:
    """Keypoints with the feet moved and the knees bent to fit (two-bone analytic IK)."""
    moved = np.array(points)
    for side in range(2):
        hip, knee, ankle, foot, toe = (
            pair(n)[side] for n in ("hip", "knee", "ankle", "foot", "big_toe")
        )
        goal = points[:, ankle] + offsets[:, side]
        knee_at, ankle_at = reach(points[:, hip], points[:, knee], points[:, ankle], goal)
        moved[:, knee] = knee_at
        for index in (ankle, foot, toe):
            moved[:, index] = points[:, index] + ankle_at - points[:, ankle]
    return moved


def reach(
    hip: Float[np.ndarray, "T 3"],
    knee: Float[np.ndarray, "T 3"],
    ankle: Float[np.ndarray, "T 3"],
    goal: Float[np.ndarray, "T 3"],
) -> tuple[Float[np.ndarray, "T 3"], Float[np.ndarray, "T 3"]]:
    """Knee and ankle for a goal, lengths kept, the knee in the half plane where it was.

    A goal out of reach is approached along its direction.
    """
    thigh = np.linalg.norm(knee - hip, axis=-1, keepdims=True)
    shin = np.linalg.norm(ankle - knee, axis=-1, keepdims=True)
    along = unit(goal - hip)
    distance = np.linalg.norm(goal - hip, axis=-1, keepdims=True)
    distance = np.clip(distance, np.abs(thigh - shin) + 1e-4, (thigh + shin) * 0.9999)
    before = knee - hip
    aside = before - np.sum(before * along, -1, keepdims=True) * along
    straight = np.linalg.norm(aside, axis=-1, keepdims=True) < 1e-9
    aside = np.where(straight, any_normal(along), unit(aside))
    forth = (thigh**2 - shin**2 + distance**2) / (2.0 * distance)
    high = np.sqrt(np.maximum(thigh**2 - forth**2, 0.0))
    return hip + along * forth + aside * high, hip + along * distance
