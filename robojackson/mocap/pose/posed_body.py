"""A posed person who can be moved: the keypoints, and the solve after each change.

Any right-handed frame, metres.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from robojackson.body import analytic_solve
from robojackson.body.feet import foot_points
from robojackson.body.forward_kinematics import Pose, forward
from robojackson.mocap.pose import twist
from robojackson.mocap.pose.keypoints import Keypoints, build
from robojackson.motion.smpl_sequence import SmplSequence


@dataclass(frozen=True)
class Body:
    """One person through a clip.

    Attributes:
        marks: The 33 landmarks, for the twist cues.
        targets: Keypoints of the solve.
        rest: Rest joints of the person.
        method: HybrIK's solve.
        local: Local rotations of the solution.
        pose: Forward kinematics of the solution.
    """

    marks: Float[np.ndarray, "T 33 3"]
    targets: Keypoints
    rest: Float[np.ndarray, "29 3"]
    method: analytic_solve.Method
    local: Float[np.ndarray, "T 24 3 3"]
    pose: Pose

    @property
    def feet(self) -> Float[np.ndarray, "T 4 3"]:
        """Return the soles under heels and toes, order of `CONTACT_POINTS`."""
        return foot_points(self.pose, self.rest)

    def shifted(self, offset: Float[np.ndarray, "*T 3"]) -> "Body":
        """Return the same pose elsewhere."""
        step = np.broadcast_to(offset, (len(self.marks), 3))[:, None]
        return replace(
            self,
            marks=self.marks + step,
            targets=replace(self.targets, points=self.targets.points + step),
            pose=replace(self.pose, points=self.pose.points + step),
        )

    def aimed(
        self,
        points: Float[np.ndarray, "T 29 3"],
        level: Float[np.ndarray, "T 2"] | None = None,
    ) -> "Body":
        """Return the pose that reaches other keypoints; `level` is the share of flat soles (z
        up)."""
        targets = replace(self.targets, points=points)
        return _solved(self.marks, targets, self.rest, self.method, level)


def pose_landmarks(
    marks: Float[np.ndarray, "T 33 3"],
    visibility: Float[np.ndarray, "T 33"],
    rest: Float[np.ndarray, "29 3"],
    method: analytic_solve.Method,
) -> Body:
    """Return the pose of the landmarks."""
    return _solved(marks, build(marks, visibility, rest), rest, method)


def pose_sequence(sequence: SmplSequence) -> Pose:
    """Return rotations and points of the SMPL parameters of a sequence, world frame."""
    count = len(sequence)
    vectors = np.concatenate([sequence.global_orient, sequence.body_pose], 1).reshape(-1, 3)
    local = Rotation.from_rotvec(vectors).as_matrix().reshape(count, -1, 3, 3)
    root = sequence.transl + sequence.rest_joints[0]
    return forward(local, sequence.rest_joints[None], root)


def _solved(
    marks: np.ndarray,
    targets: Keypoints,
    rest: np.ndarray,
    method: analytic_solve.Method,
    level: np.ndarray | None = None,
) -> Body:
    cues = twist.cues(targets, marks)
    if level is not None:
        cues |= twist.level_cues(cues, level)
    turns = twist.rule(cues, rest)
    local = analytic_solve.solve_with(targets.points, rest[None], turns, method)
    pose = forward(local, rest[None], targets.points[:, 0])
    return Body(marks, targets, rest, method, local, pose)
