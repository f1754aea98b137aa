"""Two-bone analytic inverse kinematics of legs: the knee of a foot that is moved.

World frame, metres.
"""

import numpy as np
from jaxtyping import Float

from robojackson.body.forward_kinematics import any_normal, unit
from robojackson.body.skeleton import pair

EASE_M = 0.01
STRAIGHT = 0.9999
TINY = 1e-9


def lift_offsets(feet: Float[np.ndarray, "T 4 3"]) -> Float[np.ndarray, "T 2 3"]:
    """Return the lift of each foot that puts neither heel nor toe under the floor."""
    lowest = feet[..., 2].reshape(-1, 2, 2).min(2)
    result: np.ndarray = np.maximum(-lowest, 0.0)[..., None] * np.array([0.0, 0.0, 1.0])
    return result


def move_feet(
    points: Float[np.ndarray, "T 29 3"], offsets: Float[np.ndarray, "T 2 3"]
) -> Float[np.ndarray, "T 29 3"]:
    """Return keypoints with the feet moved and the knees bent to fit (two-bone analytic IK)."""
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
    """Return knee and ankle for a goal, lengths kept, the knee in its half plane.

    A goal out of reach is approached along its direction. The last centimetres before a straight
    leg are eased: there the knee moves like the square root of the foot's remaining distance.
    """
    thigh = np.linalg.norm(knee - hip, axis=-1, keepdims=True)
    shin = np.linalg.norm(ankle - knee, axis=-1, keepdims=True)
    along = unit(goal - hip)
    distance, now = (np.linalg.norm(end - hip, axis=-1, keepdims=True) for end in (goal, ankle))
    distance = np.maximum(_eased(distance, now, thigh + shin), np.abs(thigh - shin) + 1e-4)
    before = knee - hip
    aside = before - np.sum(before * along, -1, keepdims=True) * along
    straight = np.linalg.norm(aside, axis=-1, keepdims=True) < 1e-9
    aside = np.where(straight, any_normal(along), unit(aside))
    forth = (thigh**2 - shin**2 + distance**2) / (2.0 * distance)
    high = np.sqrt(np.maximum(thigh**2 - forth**2, 0.0))
    return hip + along * forth + aside * high, hip + along * distance


def _eased(distance: np.ndarray, now: np.ndarray, longest: np.ndarray) -> np.ndarray:
    """Return the distance itself up to `EASE_M` before the longest, then a smooth approach to it.

    A leg that is already straighter does not change.
    """
    longest = longest * STRAIGHT
    start = np.clip(now, longest - EASE_M, longest - TINY)
    room, beyond = longest - start, np.maximum(distance - start, 0.0)
    result: np.ndarray = np.minimum(distance, start) + room * (1.0 - np.exp(-beyond / room))
    return result
