"""The Trajectory .npz of LocoMuJoCo 1.0: its info, the model's constants, and the data.

Frames are the control steps themselves, `frequency` in Hz; quaternions wxyz; all bodies including
the world, and all sites including the robot's keypoints. float64, metres, radians, world frame.
"""

import mujoco
import numpy as np

from robojackson.formats.containers import npz_archive
from robojackson.formats.format import RobotExporter, refusing
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.robot.body_states import body_states, names, require_same_joints
from robojackson.robot.sampling import SampledMotion, sampled

MODEL_ARRAYS = (
    *("njnt", "jnt_type", "nbody", "body_rootid", "body_weldid", "body_mocapid", "body_pos"),
    *("body_quat", "body_ipos", "body_iquat", "nsite", "site_bodyid", "site_pos", "site_quat"),
)


def write(reference: ReferenceMotion, model: mujoco.MjModel) -> bytes:
    """Return the .npz of a reference motion.

    Raises:
        UnknownName: the model has other joints than the reference motion.
    """
    require_same_joints(reference, model)
    motion = sampled(reference)
    info = {"frequency": np.array(motion.fps)}
    info |= {f"{kind}_names": np.array(names(model, kind)) for kind in ("joint", "body", "site")}
    constants = {name: np.array(getattr(model, name)) for name in MODEL_ARRAYS}
    return npz_archive.pack(info | constants | _data(motion, model))


def read(data: bytes) -> SampledMotion:
    """Return the motion of an .npz that holds one trajectory.

    Raises:
        BadTable: not such a file.
    """
    arrays = npz_archive.unpack(data, ("frequency", "qpos", "qvel"), "LocoMuJoCo npz")
    with refusing("LocoMuJoCo npz"):
        return SampledMotion(float(arrays["frequency"]), arrays["qpos"], arrays["qvel"])


def _data(motion: SampledMotion, model: mujoco.MjModel) -> dict[str, np.ndarray]:
    states = body_states(model, motion.qpos, motion.qvel)
    return {
        "qpos": motion.qpos,
        "qvel": np.asarray(motion.qvel),
        "xpos": states.position,
        "xquat": states.quaternion,
        "cvel": states.com_velocity,
        "subtree_com": states.subtree_com,
        "site_xpos": states.site_position,
        "site_xmat": states.site_rotation,
        "split_points": np.array([0, len(motion)]),
    }


EXPORT = RobotExporter("locomujoco", write)
