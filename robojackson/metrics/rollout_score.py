"""Scores of a rollout: site error, skill against the best frozen pose, liveliness of limbs.

Positions are in the pelvis-heading frame: relative to the pelvis site, turned so that the root's
heading is +x. Metres, seconds. Millimetres alone mean nothing: a frozen mean pose scores 51-74 mm
on a hip-shake, so errors are given relative to the best frozen pose, and limbs by their velocities.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from robojackson.geometry.rotations import heading

FROZEN_CANDIDATES = 24


@dataclass(frozen=True)
class LimbResponse:
    """Response of one limb end to its reference, at the best lag.

    Attributes:
        gain: sum(v . v_ref) / sum(v_ref^2) over moving frames; 1 is the reference's amplitude.
        r2: 1 - sum |v - v_ref|^2 / sum |v_ref|^2 over moving frames.
        excess_m_s: Root mean square speed where the reference is still, beyond the reference's.
        lag_s: Delay at which the velocities agree best, seconds.
        moving_share: Share of frames in which the reference moves.
    """

    gain: float
    r2: float
    excess_m_s: float
    lag_s: float
    moving_share: float


def heading_frame(
    points: Float[np.ndarray, "*T K 3"], root: Float[np.ndarray, "*T 4"], pelvis: int
) -> Float[np.ndarray, "*T K 3"]:
    """Return the points relative to the pelvis, turned by minus the root's heading (quaternion
    wxyz)."""
    yaw = heading(root)
    c, s = np.cos(yaw)[..., None], np.sin(yaw)[..., None]
    offset = points - points[..., pelvis, None, :]
    x, y, z = np.moveaxis(offset, -1, 0)
    return np.stack([c * x + s * y, -s * x + c * y, z], -1)


def site_error(
    points: Float[np.ndarray, "*T K 3"], target: Float[np.ndarray, "*T K 3"]
) -> Float[np.ndarray, "*T"]:
    """Return the mean distance of the points, metres, both in the pelvis-heading frame."""
    result: np.ndarray = np.mean(np.linalg.norm(points - target, axis=-1), -1)
    return result


def best_frozen_error(target: Float[np.ndarray, "T K 3"]) -> float:
    """Return the lowest mean site error of a pose that never moves, metres.

    Candidates are the mean of the points and up to `FROZEN_CANDIDATES` poses of the clip itself.
    """
    chosen = np.linspace(0, len(target) - 1, min(len(target), FROZEN_CANDIDATES)).astype(int)
    candidates = np.concatenate([target.mean(0, keepdims=True), target[chosen]])
    return float(min(site_error(target, pose[None]).mean() for pose in candidates))


STILL_M = 1e-3
"""Error of the best frozen pose of a reference that does not move, metres."""


def skill(error_m: float, frozen_error_m: float) -> float:
    """Return 1 - error / error of the best frozen pose: 1 is perfect, 0 no better than a statue.

    NaN where the reference itself hardly moves: a statue is perfect there.
    """
    return 1.0 - error_m / frozen_error_m if frozen_error_m > STILL_M else float("nan")


def limb_response(
    limb: Float[np.ndarray, "T 3"],
    target: Float[np.ndarray, "T 3"],
    dt: float,
    fast: float,
    max_lag: float,
) -> LimbResponse | None:
    """Compare the velocities of one limb end with the reference's; None when too short.

    Args:
        limb, target: Positions in the pelvis-heading frame, metres.
        dt: Seconds a step.
        fast: Reference speed from which a frame counts as moving, m/s.
        max_lag: Longest delay that is tried, seconds.
    """
    lags = range(int(max_lag / dt + 1e-9) + 1)
    if len(limb) < 4 * len(lags):
        return None
    speed, goal = np.diff(limb, axis=0) / dt, np.diff(target, axis=0) / dt
    misses = [float(np.mean((speed[lag:] - goal[: len(goal) - lag]) ** 2)) for lag in lags]
    lag = int(np.argmin(misses))
    speed, goal = speed[lag:], goal[: len(goal) - lag]
    norm = np.linalg.norm(goal, axis=-1)
    moving = norm > fast
    still_excess = np.linalg.norm(speed, axis=-1)[~moving] - norm[~moving]
    power = float(np.sum(goal[moving] ** 2))
    gain = float(np.sum(speed[moving] * goal[moving]) / power) if power else float("nan")
    miss = float(np.sum((speed[moving] - goal[moving]) ** 2))
    return LimbResponse(
        gain=gain,
        r2=1.0 - miss / power if power else float("nan"),
        excess_m_s=float(np.sqrt(np.mean(np.maximum(still_excess, 0.0) ** 2)))
        if len(still_excess)
        else 0.0,
        lag_s=lag * dt,
        moving_share=float(moving.mean()),
    )
