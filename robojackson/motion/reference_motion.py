"""The target trajectory of a robot, one row a control step.

World frame: x forward, y left, z up, metres, the floor at z = 0; quaternions wxyz.
"""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float, Int

from robojackson.motion.certificate import Certificate


@dataclass(frozen=True)
class ReferenceMotion:
    """What the robot shall do, at its own control rate.

    A cyclic motion has `len(self)` steps a cycle and continues with its first step, moved by
    `cycle_offset`; a motion that is not cyclic ends at its last step.

    Attributes:
        robot: Name of the robot description (`configs/robots/<robot>.yaml`).
        model_sha256: Digest of the MJCF that the motion was made for.
        dt: Seconds a control step (Humanoid-v5: 0.015).
        cyclic: Whether the motion may be looped.
        cycle_offset: Root displacement of one cycle, metres, world; zero unless cyclic.
        qpos: MuJoCo positions, root quaternion wxyz.
        qvel: MuJoCo velocities: root linear in the world, root angular in the body, hinges.
        body_pos_w: Origins of the bodies, metres, world.
        keypoints_w: The robot's own keypoint sites (hands and head among them), metres, world.
        contact: State of the robot's contact points: 0 air, 1 planted, 2 sliding.
        torque_ratio: |torque| / limit a mj_joint with an actuator, from inverse dynamics.
        source_time_s: Time in the source clip that each step shows, seconds.
        joint_names, body_names, keypoint_names, contact_names: What the columns are.
        scorecard: Figures that say how good the motion is.
        certificate: What the robot cannot do in it; None where nobody has looked.
    """

    robot: str
    model_sha256: str
    dt: float
    cyclic: bool
    cycle_offset: Float[np.ndarray, "3"]
    qpos: Float[np.ndarray, "S nq"]
    qvel: Float[np.ndarray, "S nv"]
    body_pos_w: Float[np.ndarray, "S nbody 3"]
    keypoints_w: Float[np.ndarray, "S K 3"]
    contact: Int[np.ndarray, "S C"]
    torque_ratio: Float[np.ndarray, "S nu"]
    source_time_s: Float[np.ndarray, " S"]
    joint_names: tuple[str, ...]
    body_names: tuple[str, ...]
    keypoint_names: tuple[str, ...]
    contact_names: tuple[str, ...]
    scorecard: Mapping[str, float] = field(default_factory=dict)
    certificate: Certificate | None = None

    def __len__(self) -> int:
        return len(self.qpos)


def poses_sha256(reference: ReferenceMotion) -> str:
    """Digest of what a robot is asked to do: the poses, and whether they go on for ever."""
    poses = np.ascontiguousarray(reference.qpos, float).tobytes()
    return hashlib.sha256(poses + bytes([reference.cyclic])).hexdigest()
