"""Guess the rest pose of a model without a description. Radians."""

from math import copysign

import mujoco
import numpy as np

from robojackson.robot.limbs import SIDES, Skeleton

BENT_RAD = 0.3
"""How far the knees are bent at rest; hips and ankles half as far."""
SIDEWAYS = 0.9
"""Least share of y in the axis of a hinge that bends a leg forward."""
DIGITS = 4
"""Decimals of an angle at a limit."""


def guess_rest(skeleton: Skeleton) -> dict[str, float]:
    """Return knees a little bent over level feet, radians; hinges that cannot be zero are at a
    limit, none beyond it."""
    model, found = skeleton.model, dict[str, float]()
    for hinge in np.flatnonzero(model.jnt_type == int(mujoco.mjtJoint.mjJNT_HINGE)):
        low, high = model.jnt_range[hinge]
        if model.jnt_limited[hinge] and not low <= 0.0 <= high:
            found[model.joint(hinge).name] = _nearest_to_zero(float(low), float(high))
    bent: dict[str, float] = {}
    for side in SIDES:
        leg = skeleton.limbs.get(f"{side}_leg")
        if leg is None:
            return found
        turns = {"hip": -BENT_RAD / 2, "knee": BENT_RAD, "ankle": -BENT_RAD / 2}
        for part, turn in turns.items():
            if part == "ankle" and not leg.parts[part]:
                continue
            across = [h for h in leg.parts[part] if abs(skeleton.data.xaxis[h][1]) > SIDEWAYS]
            if not across:
                return found
            angle = turn * float(np.sign(skeleton.data.xaxis[across[0]][1]))
            low, high = model.jnt_range[across[0]]
            if model.jnt_limited[across[0]] and not low < angle < high:
                return found
            bent[model.joint(across[0]).name] = angle
    return found | bent


def _nearest_to_zero(low: float, high: float) -> float:
    """Return the angle of a range without zero that is nearest to zero, rounded into the range;
    the limit itself in a range that holds no such angle."""
    limit = low if low > 0.0 else high
    near = round(limit, DIGITS)
    inward = round(near + copysign(10.0**-DIGITS, limit), DIGITS)
    return next((angle for angle in (near, inward) if low <= angle <= high), limit)
