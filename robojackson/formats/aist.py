"""The pickle of AIST++: smpl_poses (T, 72), smpl_trans, smpl_scaling; y up, 60 frames a second.

The path is in units of the scaling: metres = smpl_trans / smpl_scaling.
"""

import numpy as np

from robojackson.errors import BadTable
from robojackson.formats.containers import safe_pickle
from robojackson.formats.foreign_motion import (
    PELVIS,
    Y_UP_TO_WORLD,
    ForeignMotion,
    matrices,
    numbers,
    rows,
    same_length,
)
from robojackson.formats.format import Importer

FPS = 60.0
WHERE = "AIST++ pickle"


def read(data: bytes) -> ForeignMotion:
    """Return the motion of a pickle; nothing in it is executed.

    Raises:
        BadTable: not such a file.
    """
    content = safe_pickle.load(data, WHERE)
    poses = rows(content, "smpl_poses", 72, WHERE)
    trans = rows(content, "smpl_trans", 3, WHERE)
    same_length(WHERE, smpl_poses=poses, smpl_trans=trans)
    scaling = numbers(content.get("smpl_scaling", 1.0)).ravel()
    if scaling.size != 1 or not np.isfinite(scaling[0]) or scaling[0] <= 0.0:
        raise BadTable(f"{WHERE}: 'smpl_scaling' is {scaling}; expected one number above zero")
    return ForeignMotion(
        fps=FPS,
        rotations=matrices(poses),
        pelvis=trans / scaling[0] + PELVIS["smpl"],
        to_world=Y_UP_TO_WORLD.copy(),
    )


IMPORT = Importer("aist", read, lambda file: "smpl_poses" in file.pickled)
