"""A person whose motion is known in closed form, and kinematics written another way than ours."""

import numpy as np
from scipy.spatial.transform import Rotation

from robojackson.mocap.imported import place
from robojackson.mocap.skeleton import PARENTS, REST_JOINTS
from robojackson.motion.foreign import ForeignMotion
from robojackson.motion.smpl import SmplSequence

FRAMES, FPS = 24, 30.0
UPRIGHT = Rotation.from_matrix([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])


def axis_angles(joints: int = 24, seed: int = 0) -> np.ndarray:
    """Joints that swing, each about its own axis, (FRAMES, joints, 3); the root does not turn."""
    rng = np.random.default_rng(seed)
    axes = rng.normal(0.0, 0.25, (joints, 3))
    phase = rng.uniform(0.0, 6.0, joints)
    wave = np.sin(2 * np.pi * np.arange(FRAMES)[:, None] / FRAMES + phase)
    vectors = wave[..., None] * axes
    vectors[:, 0] = 0.0
    return vectors


def path(speed: float = 0.8) -> np.ndarray:
    """Of the pelvis: forward, swaying, metres."""
    time = np.arange(FRAMES) / FPS
    return np.stack([speed * time, 0.1 * np.sin(6.0 * time), 0.95 + 0.02 * np.cos(9.0 * time)], -1)


def posed(vectors: np.ndarray, root: Rotation, pelvis: np.ndarray) -> np.ndarray:
    """Joints of one frame by a walk up the tree for each of them."""
    points = np.zeros((24, 3))
    for joint in range(24):
        place, node = np.zeros(3), joint
        while node > 0:
            parent = PARENTS[node]
            offset = REST_JOINTS[node] - REST_JOINTS[parent]
            turn = root if parent == 0 else Rotation.from_rotvec(vectors[parent])
            place = turn.apply(place + offset)
            node = parent
        points[joint] = pelvis + place
    return points


def joints_of(vectors: np.ndarray, pelvis: np.ndarray) -> np.ndarray:
    """All frames, the root upright in our world, (FRAMES, 24, 3)."""
    return np.stack([posed(v, UPRIGHT, p) for v, p in zip(vectors, pelvis, strict=True)])


def person(legs: float = 1.0, speed: float = 0.8) -> SmplSequence:
    """The motion as our own table has it; `legs` is how far hips, knees and ankles swing."""
    vectors = axis_angles()
    vectors[:, [1, 2, 4, 5, 7, 8]] *= legs
    vectors[:, 0] = UPRIGHT.as_rotvec()
    turns = Rotation.from_rotvec(vectors.reshape(-1, 3)).as_matrix().reshape(FRAMES, 24, 3, 3)
    return place(ForeignMotion(FPS, turns, path(speed)), FPS)
