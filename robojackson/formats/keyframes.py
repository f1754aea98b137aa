"""MuJoCo keyframes: an MJCF fragment with one key a control step, for `<include file="..."/>`.

time in seconds; qpos with the root quaternion wxyz; qvel as MuJoCo has it. In the viewer of
`python -m mujoco.viewer` the keys are under "Keyframe".
"""

from xml.etree import ElementTree

import numpy as np

from robojackson.formats.format import RobotExporter, refusing
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.robot.sampling import SampledMotion, sampled


def write(reference: ReferenceMotion) -> bytes:
    """Return the fragment; its root is `mujocoinclude`, so that any model can include it."""
    motion = sampled(reference)
    root = ElementTree.Element("mujocoinclude")
    keyframe = ElementTree.SubElement(root, "keyframe")
    for step, (qpos, qvel) in enumerate(zip(motion.qpos, np.asarray(motion.qvel), strict=True)):
        facts = {"name": f"step_{step}", "time": f"{step / motion.fps:.6f}"}
        facts |= {"qpos": _numbers(qpos), "qvel": _numbers(qvel)}
        ElementTree.SubElement(keyframe, "key", facts)
    ElementTree.indent(root)
    result: bytes = ElementTree.tostring(root, encoding="utf-8", xml_declaration=False) + b"\n"
    return result


def read(data: bytes) -> SampledMotion:
    """Return the motion of a fragment with at least two keys.

    Raises:
        BadTable: not such a file.
    """
    with refusing("keyframes"):
        keys = ElementTree.fromstring(data).findall("keyframe/key")
        rows = {
            name: np.array([key.attrib[name].split() for key in keys], float)
            for name in ("time", "qpos", "qvel")
        }
        if len(keys) < 2:
            raise ValueError(f"{len(keys)} keys, no motion")
        with np.errstate(all="ignore"):
            fps = (len(keys) - 1) / (rows["time"][-1, 0] - rows["time"][0, 0])
        return SampledMotion(float(fps), rows["qpos"], rows["qvel"])


def _numbers(values: np.ndarray) -> str:
    return " ".join(f"{value:.10g}" for value in values)


EXPORT = RobotExporter("keyframes", lambda reference, _: write(reference))
