"""The paper's mapping (Table I): SMPL rotation vectors copied to hinges.

Global scale by leg length, linear interpolation to the control step, Gaussian smoothing. `literal`
copies the components as SMPL has them (x left, y up, z forward); `corrected` turns them into the
robot's axes (x forward, y left, z up), respects the signs of the left hips and knees, drives the
abdomen and clips to the limits. A baseline, so that the improvement is a row in a table.
"""

import numpy as np
from jaxtyping import Float
from scipy.ndimage import gaussian_filter1d
from scipy.spatial.transform import Rotation, Slerp

from robojackson.body.skeleton import JOINT_NAMES, KEYPOINT_NAMES
from robojackson.errors import BadConfiguration
from robojackson.geometry.frames import SMPL_TO_WORLD
from robojackson.geometry.rotations import from_rotation, sign_continuous
from robojackson.motion.smpl_sequence import SmplSequence
from robojackson.retarget.targets.keypoint_targets import leg_ratio
from robojackson.robot.model import Robot
from robojackson.robot.tree_kinematics import pose, tree

_SMOOTHING_S = 2 / 60  # two frames at 60 Hz, standard deviation of the Gaussian
_LITERAL = {
    "hip_x": ("hip", 0),
    "hip_y": ("hip", 1),
    "hip_z": ("hip", 2),
    "knee": ("knee", 0),
    "shoulder1": ("shoulder", 0),
    "shoulder2": ("shoulder", 1),
    "elbow": ("elbow", 1),
}
_CORRECTED = _LITERAL | {"knee": ("knee", 1), "elbow": ("elbow", 2)}


def mapped(
    sequence: SmplSequence, robot: Robot, time_s: Float[np.ndarray, " S"], corrected: bool
) -> Float[np.ndarray, "S nq"]:
    """Return qpos by Table I at the given times in the clip."""
    hinges_there = {name.partition("_")[2] for name in robot.joint_names}
    if missing := sorted(_LITERAL.keys() - hinges_there):
        raise BadConfiguration(
            f"retarget.method: the paper's table names hinges of Humanoid-v5, and robot "
            f"{robot.description.name!r} has no {', '.join(missing)}; take method=optimise"
        )
    frames = np.arange(len(sequence)) / sequence.fps
    hinges = _hinges(sequence, robot, corrected)
    root = _root(sequence, robot)
    qpos = np.zeros((len(time_s), robot.model.nq))
    sigma = _SMOOTHING_S / robot.description.control_dt
    turns = Rotation.from_rotvec(sequence.global_orient) * Rotation.from_matrix(SMPL_TO_WORLD.T)
    inside = np.minimum(time_s, frames[-1])  # the last may be later by its last digit
    qpos[:, 3:7] = sign_continuous(from_rotation(Slerp(frames, turns)(inside)))
    for column in range(3):
        qpos[:, column] = _smoothed(np.interp(time_s, frames, root[:, column]), sigma)
    for column in range(hinges.shape[1]):
        qpos[:, 7 + column] = _smoothed(np.interp(time_s, frames, hinges[:, column]), sigma)
    if corrected:
        qpos[:, 7:] = np.clip(qpos[:, 7:], robot.lower, robot.upper)
    return qpos


def _smoothed(values: np.ndarray, sigma: float) -> np.ndarray:
    return np.asarray(gaussian_filter1d(values, sigma, mode="nearest"))


def _root(sequence: SmplSequence, robot: Robot) -> Float[np.ndarray, "T 3"]:
    """Return the torso where the globally scaled pelvis would hold it."""
    human = {name: sequence.keypoints_w[:, i] for i, name in enumerate(KEYPOINT_NAMES)}
    pelvis = sequence.keypoints_w[:, 0] * leg_ratio(human, robot)
    upright = pose(tree(robot), robot.model.qpos0[None])
    offset = upright.body_pos[0, tree(robot).root]
    offset = offset - upright.site_pos[0, robot.keypoint_names.index("pelvis")]
    turns = Rotation.from_rotvec(sequence.global_orient) * Rotation.from_matrix(SMPL_TO_WORLD.T)
    return np.asarray(pelvis + turns.apply(offset))


def _hinges(sequence: SmplSequence, robot: Robot, corrected: bool) -> Float[np.ndarray, "T J"]:
    vectors = sequence.body_pose.reshape(len(sequence), 23, 3)
    if corrected:
        vectors = vectors @ SMPL_TO_WORLD.T
    table = _CORRECTED if corrected else _LITERAL
    out = np.zeros((len(sequence), len(robot.joint_names)))
    for index, name in enumerate(robot.joint_names):
        side, _, hinge = name.partition("_")
        if hinge in table:
            joint, component = table[hinge]
            value = vectors[:, JOINT_NAMES.index(f"{side}_{joint}") - 1, component]
            out[:, index] = value * (_sign(side, hinge) if corrected else 1.0)
        elif corrected and side == "abdomen":
            spine = [JOINT_NAMES.index(f"spine{i}") - 1 for i in (1, 2, 3)]
            out[:, index] = vectors[:, spine, "xyz".index(hinge)].sum(axis=1)
    return out


def _sign(side: str, hinge: str) -> float:
    """Return the sign of a hinge: Humanoid-v5 negates the left hip's x and z axes and bends knees
    about -y."""
    return -1.0 if hinge == "knee" or (side == "left" and hinge in ("hip_x", "hip_z")) else 1.0
