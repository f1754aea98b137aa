"""Fall detection: the rule of the robot's description, bound to its size. Metres, radians.

`BESIDE` and `STRICT` are the rules that a first description gets, the G1's: differences to the
reference at every step, so that a bow or a knee on the floor is no fault where the dancer bows or
kneels, and a motion that ends gets tails.
"""

from dataclasses import dataclass

import mujoco
import numpy as np
from jaxtyping import Bool, Float

from robojackson.robot.description import FallRule, StrictRule
from robojackson.robot.model import Robot

FALL_HEIGHT_M = 0.7
"""The paper's fall rule for Humanoid-v5: a lower torso has fallen."""
FALL_SHARE = 0.55
"""Of the height at which a smaller robot's root stands: lower, it has fallen."""
BESIDE = FallRule(frame="reference", height=0.25, tilt=0.8)
STRICT = StrictRule(sites=0.20, ends=0.25, knees=None, floor=True)


@dataclass(frozen=True)
class Fall:
    """The fall rule of a robot (`robot.description.FallRule`).

    Attributes:
        relative: Whether height and tilt are differences to the reference's root.
        height: Root lower than this, or farther from the reference's height, m.
        tilt: Up axis farther from vertical, or from the reference's, rad.
    """

    relative: bool
    height: float
    tilt: float

    @staticmethod
    def of(robot: Robot, height: float | None = None, tilt: float | None = None) -> "Fall":
        """Return the rule of a robot; `height` and `tilt` replace its numbers."""
        rule = robot.description.fall
        return Fall(
            relative=rule.frame == "reference",
            height=_least(robot) if height is None else height,
            tilt=rule.tilt if tilt is None else tilt,
        )

    @property
    def cos_tilt(self) -> float:
        """Cosine of the tilt; of one beyond half a turn it would be that of a smaller one."""
        return float(np.cos(min(self.tilt, np.pi)))

    def has_fallen(
        self, qpos: Float[np.ndarray, "N nq"], target: Float[np.ndarray, "N nq"]
    ) -> Bool[np.ndarray, " N"]:
        """Return which of N robots have fallen; `target` is the reference's state at the same
        step."""
        if not self.relative:
            upright = up_axis(qpos[:, 3:7])[:, 2]
            found: np.ndarray = (qpos[:, 2] < self.height) | (upright < self.cos_tilt)
            return found
        along = alignment(qpos, target)
        off = np.abs(qpos[:, 2] - target[:, 2])
        result: np.ndarray = (off > self.height) | (along < self.cos_tilt)
        return result


def alignment(
    qpos: Float[np.ndarray, "N nq"], other: Float[np.ndarray, "N nq"]
) -> Float[np.ndarray, " N"]:
    """Return the cosines of the angles between the up axes of roots."""
    result: np.ndarray = np.sum(up_axis(qpos[:, 3:7]) * up_axis(other[:, 3:7]), -1)
    return result


def up_axis(quaternion: Float[np.ndarray, "N 4"]) -> Float[np.ndarray, "N 3"]:
    """Return the body's z axis in the world, for quaternions wxyz."""
    w, x, y, z = np.asarray(quaternion).T
    return np.stack([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)], -1)


def standing_height(robot: Robot) -> float:
    """Return the height of the root over the soles in the rest pose, metres."""
    data = mujoco.MjData(robot.model)
    data.qpos[:] = robot.standing
    mujoco.mj_kinematics(robot.model, data)
    feet = data.site_xpos[robot.keypoint_sites[robot.contact_keypoints], 2]
    soles = feet + robot.contact_arms[:, 2] - robot.contact_radii
    return float(data.qpos[2] - soles.min())


def rule_lines() -> list[str]:
    """Return the blocks `fall` and `strict` of a description."""
    return [
        "fall: # it has fallen where its root is so far from the reference's",
        f"  frame: {BESIDE.frame} # a motion that ends begins and ends standing, too",
        f"  height: {BESIDE.height} # metres; less for a robot much smaller than a person",
        f"  tilt: {BESIDE.tilt} # radians between the up axes",
        "strict: # strict success, at every step; metres",
        f"  sites: {STRICT.sites} # mean distance of the keypoints from the reference's",
        f"  ends: {STRICT.ends} # in height, of feet and hands",
        "  knees: null # the line below is the rule for them",
        f"  floor: {str(STRICT.floor).lower()} # nothing on it that the reference has not there",
    ]


def _least(robot: Robot) -> float:
    rule = robot.description.fall
    if rule.height is not None:
        return rule.height
    return min(FALL_HEIGHT_M, FALL_SHARE * standing_height(robot))
