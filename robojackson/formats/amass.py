"""The .npz of AMASS: SMPL+H (poses 156) or SMPL-X (root_orient, pose_body), z up, metres.

Written as SMPL+H, with our skeleton beside it as `rest_joints`; fingers and SMPL's hand joints are
not in it. The frame rate has two spellings and is stamped wrong in some sets (BMLhandball).
"""

import numpy as np

from robojackson.errors import BadTable
from robojackson.formats.containers import npz_archive
from robojackson.formats.foreign_motion import (
    BODY_JOINTS,
    PELVIS,
    REST_KEY,
    ForeignMotion,
    betas_of,
    body_vectors,
    matrices,
    number,
    rows,
    same_length,
    skeleton_of,
)
from robojackson.formats.format import Importer, PersonExporter
from robojackson.motion.smpl_sequence import SmplSequence

RATES = ("mocap_framerate", "mocap_frame_rate")
KNOWN_ARRAYS = {"poses", "trans", "betas", "root_orient", "pose_body", REST_KEY, *RATES}
WHERE = "AMASS npz"
_BODY = 3 * BODY_JOINTS


def write(sequence: SmplSequence) -> bytes:
    """Return the .npz of a motion, SMPL+H."""
    poses = np.zeros((len(sequence), 156))
    poses[:, :_BODY] = body_vectors(sequence)[:, :_BODY]
    pelvis = sequence.transl + sequence.rest_joints[0]
    return npz_archive.pack(
        {
            "poses": poses,
            "trans": pelvis - PELVIS["smpl"],
            "betas": np.concatenate([sequence.betas, np.zeros(6)]),
            "dmpls": np.zeros((len(sequence), 8)),
            "gender": np.array("neutral"),
            "mocap_framerate": np.array(float(sequence.fps)),
            REST_KEY: sequence.rest_joints,
        }
    )


def read(data: bytes) -> ForeignMotion:
    """Return the motion of an .npz.

    Raises:
        BadTable: not such a file.
    """
    content = npz_archive.unpack(data, ("trans",), WHERE, KNOWN_ARRAYS)
    extended = "pose_body" in content
    if extended:
        parts = rows(content, "root_orient", 3, WHERE), rows(content, "pose_body", 63, WHERE)
        same_length(WHERE, root_orient=parts[0], pose_body=parts[1])
        poses = np.concatenate(parts, axis=1)
    else:
        poses = _poses(content)
    trans = rows(content, "trans", 3, WHERE)
    same_length(WHERE, poses=poses, trans=trans)
    return ForeignMotion(
        fps=_rate(content),
        rotations=matrices(poses),
        pelvis=trans + PELVIS["smplx" if extended else "smpl"],
        rest_joints=skeleton_of(content),
        betas=betas_of(content),
    )


def _poses(content: dict[str, np.ndarray]) -> np.ndarray:
    """Return the body's joints of SMPL (72), SMPL+H (156) or SMPL-X (165) rows."""
    if "poses" not in content:
        raise BadTable(f"{WHERE}: neither 'poses' nor 'pose_body' is in it")
    width = content["poses"].shape[-1] if content["poses"].ndim else 0
    if width not in (_BODY, 72, 156, 165):
        raise BadTable(f"{WHERE}: 'poses' is {content['poses'].shape}; expected 66, 72, 156 or 165")
    return rows(content, "poses", width, WHERE)[:, : 72 if width == 72 else _BODY]


def _rate(content: dict[str, np.ndarray]) -> float | None:
    for name in RATES:
        if (rate := number(content.get(name))) is not None:
            return rate
    return None


EXPORT = PersonExporter("amass", write)
IMPORT = Importer("amass", read, lambda file: bool(file.members) and "data.pkl" not in file.members)
