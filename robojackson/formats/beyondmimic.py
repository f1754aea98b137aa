"""The motion .npz that BeyondMimic (`whole_body_tracking`) and mjlab train on.

Keys fps [1], joint_pos, joint_vel, body_pos_w, body_quat_w (wxyz), body_lin_vel_w, body_ang_vel_w;
float32, 50 fps (an integer; float64 where a pack's rate is not whole), world frame, metres and
radians; velocities are those of the bodies' origins. The first body is the root. Joints and bodies
are in MuJoCo's order, which is mjlab's; Isaac Lab walks the tree breadth first, so two keys more,
joint_names and body_names, say what the columns are.
"""

import mujoco
import numpy as np

from robojackson.formats.containers import npz_archive
from robojackson.formats.format import RobotExporter, refusing
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.robot.body_states import body_states, names, require_same_joints
from robojackson.robot.sampling import SampledMotion, sampled

FPS = 50


def write(reference: ReferenceMotion, model: mujoco.MjModel) -> bytes:
    """Return the .npz of a reference motion.

    Raises:
        UnknownName: the model has other joints than the reference motion.
    """
    require_same_joints(reference, model)
    return npz_archive.pack(motion_arrays(sampled(reference, FPS), model))


def motion_arrays(motion: SampledMotion, model: mujoco.MjModel) -> dict[str, np.ndarray]:
    """Return the arrays of the .npz of a motion whose velocities are known."""
    qvel = np.asarray(motion.qvel)
    states = body_states(model, motion.qpos, qvel)
    figures = {
        "joint_pos": motion.qpos[:, 7:],
        "joint_vel": qvel[:, 6:],
        "body_pos_w": states.position[:, 1:],
        "body_quat_w": states.quaternion[:, 1:],
        "body_lin_vel_w": states.linear[:, 1:],
        "body_ang_vel_w": states.angular[:, 1:],
    }
    return (
        {"fps": np.array([int(motion.fps) if float(motion.fps).is_integer() else motion.fps])}
        | {name: values.astype(np.float32) for name, values in figures.items()}
        | {"joint_names": np.array(names(model, "joint")[1:])}
        | {"body_names": np.array(names(model, "body")[1:])}
    )


def read(data: bytes) -> SampledMotion:
    """Return the motion of an .npz.

    Raises:
        BadTable: not such a file.
    """
    needed = ("fps", "joint_pos", "body_pos_w", "body_quat_w")
    arrays = npz_archive.unpack(data, needed, "BeyondMimic npz")
    with refusing("BeyondMimic npz"):
        root = arrays["body_pos_w"][:, 0], arrays["body_quat_w"][:, 0]
        qpos = np.concatenate([*root, arrays["joint_pos"]], axis=1).astype(float)
        return SampledMotion(float(arrays["fps"].ravel()[0]), qpos)


EXPORT = RobotExporter("beyondmimic", write, FPS)
