"""A posed person whose twists are given, for example by a network, instead of computed from
landmarks.

The floor turns only the ankle of a flat foot. Metres, any right-handed frame.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from robojackson.body import analytic_solve
from robojackson.body.forward_kinematics import forward, kabsch, unit
from robojackson.body.skeleton import AIM_CHILD, keypoint, pair
from robojackson.mocap.pose import twist
from robojackson.mocap.pose.keypoints import UP, Keypoints
from robojackson.mocap.pose.posed_body import Body

ABOVE = np.array([0.0, 0.0, 1.0])
ANKLES = pair("ankle")
CHEST = tuple(keypoint(name) for name in ("neck", "left_collar", "right_collar"))


@dataclass(frozen=True)
class TurnedBody(Body):
    """A `Body` that keeps its own twists when it is solved again.

    Attributes:
        turns: (cos, sin) of joints 1..23 about their rest bones.
    """

    turns: Float[np.ndarray, "T 23 2"]

    def aimed(
        self,
        points: Float[np.ndarray, "T 29 3"],
        level: Float[np.ndarray, "T 2"] | None = None,
    ) -> "TurnedBody":
        """Return the pose that reaches other keypoints; `level` is the share of flat soles (z
        up)."""
        rule = _rule(self.turns, self.rest, level)
        local = analytic_solve.solve_with(points, self.rest[None], rule, self.method)
        pose = forward(local, self.rest[None], points[:, 0])
        return replace(self, targets=replace(self.targets, points=points), local=local, pose=pose)


def pose_keypoints(
    points: Float[np.ndarray, "T 29 3"],
    turns: Float[np.ndarray, "T 23 2"],
    confidence: Float[np.ndarray, "T 29"],
    rest: Float[np.ndarray, "29 3"],
    method: analytic_solve.Method,
) -> TurnedBody:
    """Return the pose of keypoints and twists."""
    count = len(points)
    still = np.broadcast_to(np.eye(3), (count, 3, 3))
    targets = Keypoints(points, still, _chest(points, rest), still, confidence)
    empty = forward(np.broadcast_to(np.eye(3), (count, 24, 3, 3)).copy(), rest[None], points[:, 0])
    marks = np.zeros((count, 33, 3))
    body = TurnedBody(marks, targets, rest, method, empty.rotations, empty, turns)
    return body.aimed(points)


def _chest(points: np.ndarray, rest: np.ndarray) -> np.ndarray:
    """Return the rotation of the chest from the three bones of its last joint."""
    joint = keypoint("spine3")
    return kabsch(rest[list(CHEST)] - rest[joint], points[:, CHEST] - points[:, joint, None])


def _rule(
    turns: np.ndarray, rest: np.ndarray, level: np.ndarray | None
) -> analytic_solve.TwistRule:
    """Return the rule of given twists; at the ankles a share of the turn that levels the sole."""

    def decide(joint: int, swung: np.ndarray) -> np.ndarray:
        given = unit(turns[:, joint - 1])
        if level is None or joint not in ANKLES:
            return given
        bone = rest[AIM_CHILD[joint]] - rest[joint]
        share = level[:, [ANKLES.index(joint)]]
        cue = twist.Cue(UP, np.broadcast_to(ABOVE, (len(turns), 3)), share[:, 0])
        angle = twist.cue_angle(cue, bone, swung)
        floor = np.stack([np.cos(angle), np.sin(angle)], -1)
        return unit(given + share * (floor - given))

    return decide
