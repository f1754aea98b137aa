"""The .npz of OmniRetarget (package `holosoma_retargeting`): fps and qpos in MuJoCo's order.

Root xyz (metres), root quaternion wxyz, hinges (radians), float64, 30 fps.
"""

import numpy as np

from robojackson.formats.containers import npz_archive
from robojackson.formats.format import RobotExporter, refusing
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.robot.sampling import SampledMotion, sampled

FPS = 30


def write(reference: ReferenceMotion) -> bytes:
    """Return the .npz of a reference motion."""
    return npz_archive.pack({"fps": np.array(FPS), "qpos": sampled(reference, FPS).qpos})


def read(data: bytes) -> SampledMotion:
    """Return the motion of an .npz.

    Raises:
        BadTable: not such a file.
    """
    arrays = npz_archive.unpack(data, ("fps", "qpos"), "OmniRetarget npz")
    with refusing("OmniRetarget npz"):
        return SampledMotion(float(arrays["fps"]), arrays["qpos"])


EXPORT = RobotExporter("omniretarget", lambda reference, _: write(reference), FPS)
