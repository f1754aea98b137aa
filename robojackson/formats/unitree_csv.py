"""The csv of Unitree's retargeted LAFAN1 set, which BeyondMimic's and mjlab's converters take.

No head; a row a frame at 30 fps: root xyz (metres), root quaternion xyzw, hinges (radians) in the
order of the MJCF.
"""

import io

import numpy as np

from robojackson.errors import BadTable
from robojackson.formats.format import RobotExporter, refusing
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.robot.sampling import WXYZ, XYZW, SampledMotion, sampled

FPS = 30


def write(reference: ReferenceMotion) -> bytes:
    """Return the csv of a reference motion, nine decimals."""
    rows = sampled(reference, FPS).qpos.copy()
    rows[:, 3:7] = rows[:, 3:7][:, XYZW]
    sink = io.StringIO()
    np.savetxt(sink, rows, fmt="%.9f", delimiter=",")
    return sink.getvalue().encode()


def read(data: bytes, fps: float = FPS) -> SampledMotion:
    """Return the motion of a csv; the file does not contain its frame rate.

    Raises:
        BadTable: not rows of numbers, or too few columns for a root and a hinge.
    """
    if not data.strip():
        raise BadTable("csv: empty")
    with refusing("csv"):
        rows = np.loadtxt(io.StringIO(data.decode()), delimiter=",", ndmin=2)
    if rows.shape[1] < 8:
        raise BadTable(f"csv: {rows.shape[1]} columns; a root has 7 and a robot has hinges")
    rows[:, 3:7] = rows[:, 3:7][:, WXYZ]
    return SampledMotion(float(fps), rows)


EXPORT = RobotExporter("csv", lambda reference, _: write(reference), FPS)
