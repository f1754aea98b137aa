"""A human motion: SMPL parameters, the joints that they pose, and what is known about each frame.

World frame: x forward, y left, z up, metres, the floor at z = 0. Rotations are axis-angle, radians.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float, Int

CONTACT_POINTS: tuple[str, ...] = ("left_heel", "left_toe", "right_heel", "right_toe")
AIR, PLANTED, SLIDING = 0, 1, 2


@dataclass(frozen=True)
class SmplSequence:
    """One person's motion, one row a frame.

    Attributes:
        fps: Frames a second; frame t is at t / fps seconds.
        global_orient: Root rotation, axis-angle, radians, world.
        body_pose: Rotations of joints 1..23 relative to their parents, axis-angle, radians.
        transl: SMPL translation, metres: pelvis = transl + rest_joints[0].
        joints: The 24 SMPL joints, metres, world.
        keypoints_w: HybrIK's 29 keypoints, metres, world (`body.skeleton.KEYPOINT_NAMES`).
        confidence: 0..1 a keypoint.
        contact: AIR, PLANTED or SLIDING for `CONTACT_POINTS`.
        valid: False where the person was not detected and the pose is interpolated.
        betas: SMPL shape coefficients, zero when the skeleton is our own.
        rest_joints: The T-pose that the parameters pose, metres, x left, y up, z forward (SMPL).
        person: Index of the tracked person in the clip.
        camera: focal_px, width, height and the pose of the camera in the world.
        notes: Warnings for the user, such as a camera that moved.
    """

    fps: float
    global_orient: Float[np.ndarray, "T 3"]
    body_pose: Float[np.ndarray, "T 69"]
    transl: Float[np.ndarray, "T 3"]
    joints: Float[np.ndarray, "T 24 3"]
    keypoints_w: Float[np.ndarray, "T 29 3"]
    confidence: Float[np.ndarray, "T 29"]
    contact: Int[np.ndarray, "T 4"]
    valid: np.ndarray
    betas: Float[np.ndarray, "10"]
    rest_joints: Float[np.ndarray, "29 3"]
    person: int = 0
    camera: Mapping[str, object] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.global_orient)
