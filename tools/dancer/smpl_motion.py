"""SMPL rotations of a motion in DeepMimic's format.

DeepMimic's humanoid rests with hanging arms and has one joint between hips and shoulders; SMPL
rests in a T-pose and has three, which share its rotation. Frames: DeepMimic x forward, y up, z
right; SMPL's body x left, y up, z forward; metres, radians.
"""

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from robojackson.body.skeleton import JOINT_NAMES, PARENTS
from robojackson.formats.foreign_motion import ForeignMotion
from robojackson.mocap.imported_motion import ground_foreign_motion
from robojackson.motion.smpl_sequence import SmplSequence
from tools.render.deepmimic import Motion

BODY_TO_DEEPMIMIC = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
"""From SMPL's body axes (x left, y up, z forward) to DeepMimic's."""
TO_WORLD = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
HANGING = {"left": Rotation.from_euler("z", -90, degrees=True),
           "right": Rotation.from_euler("z", 90, degrees=True)}  # fmt: skip
"""From the T-pose to hanging arms, in SMPL's body axes."""


def smpl_sequence(motion: Motion) -> SmplSequence:
    """Return the motion as a person's, on the floor."""
    turned = world_rotations(motion)
    matrices = np.stack([turned[name].as_matrix() for name in JOINT_NAMES], 1)
    local = matrices.copy()
    for joint, parent in enumerate(PARENTS[1 : len(JOINT_NAMES)], 1):
        local[:, joint] = np.swapaxes(matrices[:, parent], 1, 2) @ matrices[:, joint]
    pelvis = motion.root_position @ TO_WORLD.T
    return ground_foreign_motion(ForeignMotion(motion.fps, local, pelvis), motion.fps)


def world_rotations(motion: Motion) -> dict[str, Rotation]:
    """Return the rotation of every SMPL joint in the world (z up) from its rest pose."""
    found = {name: _in_world(rotation) for name, rotation in motion.rotations.items()}
    root, chest, neck = found["root"], found["chest"], found["neck"]
    turned = {"pelvis": root, "spine3": chest, "neck": _between(chest, neck, 0.5), "head": neck}
    turned |= {f"spine{i}": _between(root, chest, i / 3) for i in (1, 2)}
    for side in ("left", "right"):
        shoulder, elbow = (
            found[f"{side}_{part}"] * HANGING[side] for part in ("shoulder", "elbow")
        )
        turned |= {f"{side}_{part}": found[f"{side}_{part}"] for part in ("hip", "knee", "ankle")}
        turned |= {f"{side}_foot": found[f"{side}_ankle"], f"{side}_collar": chest}
        turned |= {f"{side}_shoulder": shoulder}
        turned |= {f"{side}_{part}": elbow for part in ("elbow", "wrist", "hand")}
    return turned


def _in_world(rotation: Rotation) -> Rotation:
    matrices: Float[np.ndarray, "T 3 3"] = TO_WORLD @ rotation.as_matrix() @ BODY_TO_DEEPMIMIC
    return Rotation.from_matrix(matrices)


def _between(first: Rotation, second: Rotation, share: float) -> Rotation:
    """Return the rotation a share of the way along the geodesic, frame by frame."""
    return first * Rotation.from_rotvec(share * (first.inv() * second).as_rotvec())
