"""The pickle of GMR (General Motion Retargeting), read by TWIST and others.

A dictionary: fps, root_pos (metres, world), root_rot (xyzw), dof_pos (radians), local_body_pos (of
the bodies, root at the origin and not turned, metres, float32), link_body_list (their names). 30
fps. NumPy 1 and 2 call their inner functions differently; the written file names only
`numpy.ndarray` and `numpy.dtype`, so that TWIST's NumPy 1.23 reads it too. `read` runs nothing
(`containers.safe_pickle`).
"""

import io
import pickle
from typing import Any

import mujoco
import numpy as np

from robojackson.formats.containers import safe_pickle
from robojackson.formats.format import RobotExporter, refusing
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.robot.body_states import body_states, names, require_same_joints
from robojackson.robot.sampling import WXYZ, XYZW, SampledMotion, sampled

FPS = 30
_UPRIGHT = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]
"""Pose of the root in local_body_pos: at the origin, not turned."""
_PROTOCOL = 4


def write(reference: ReferenceMotion, model: mujoco.MjModel) -> bytes:
    """Return the pickle of a reference motion.

    Raises:
        UnknownName: the model has other joints than the reference motion.
    """
    require_same_joints(reference, model)
    motion = sampled(reference, FPS)
    upright = motion.qpos.copy()
    upright[:, :7] = _UPRIGHT
    content = {
        "fps": FPS,
        "root_pos": motion.qpos[:, :3].copy(),
        "root_rot": motion.qpos[:, 3:7][:, XYZW],
        "dof_pos": motion.qpos[:, 7:].copy(),
        "local_body_pos": body_states(model, upright).position[:, 1:].astype(np.float32),
        "link_body_list": names(model, "body")[1:],
    }
    sink = io.BytesIO()
    _Portable(sink, protocol=_PROTOCOL).dump(content)
    return sink.getvalue()


def read(data: bytes) -> SampledMotion:
    """Return the motion of a pickle.

    Raises:
        BadTable: not such a file, or one that holds anything but arrays of numbers.
    """
    content = safe_pickle.load(data, "GMR pickle")
    with refusing("GMR pickle"):
        parts = content["root_pos"], content["root_rot"][:, WXYZ], content["dof_pos"]
        return SampledMotion(float(content["fps"]), np.concatenate(parts, axis=1))


class _Portable(pickle.Pickler):
    """A pickler of arrays that every NumPy can read."""

    def reducer_override(self, value: Any) -> Any:
        if type(value) is not np.ndarray:
            return NotImplemented
        return np.ndarray, ((0,),), value.__reduce__()[2]


EXPORT = RobotExporter("gmr", write, FPS)
