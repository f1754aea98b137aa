"""The `.pt` of GVHMR: smpl_params_global (y up), smpl_params_incam (camera: y down) and K_fullimg.

Each of the two is body_pose (T, 63), global_orient (T, 3), transl (T, 3), betas (T, 10) of SMPL-X,
metres, radians. The file has no frame rate; GVHMR's demo converts any video to 30. The camera's
part is written only where the motion knows its camera; our skeleton is added.
"""

import numpy as np

from robojackson.errors import BadTable
from robojackson.formats.containers import torch_archive
from robojackson.formats.foreign_motion import (
    PELVIS,
    REST_KEY,
    Y_UP_TO_WORLD,
    ForeignMotion,
    betas_of,
    listed,
    matrices,
    number,
    rows,
    same_length,
    skeleton_of,
    turned_root,
)
from robojackson.formats.format import Importer, PersonExporter
from robojackson.motion.smpl_sequence import SmplSequence

FPS = 30.0
WHERE = "GVHMR .pt"
WORLD = "smpl_params_global"


def write(sequence: SmplSequence) -> bytes:
    """Return the `.pt` of a motion."""
    content: dict[str, object] = {WORLD: _parameters(sequence, Y_UP_TO_WORLD.T, np.zeros(3))}
    camera = sequence.camera
    known = {"rotation_w", "position_w", "focal_px", "width", "height"} <= set(camera)
    if known and not camera.get("moved"):  # only the first frame's is stored
        turn = np.array(camera["rotation_w"], float).T
        place = np.array(camera["position_w"], float)
        content["smpl_params_incam"] = _parameters(sequence, turn, place)
        content["K_fullimg"] = np.tile(_intrinsics(sequence), (len(sequence), 1, 1))
    return torch_archive.save(
        content | {"fps": float(sequence.fps), REST_KEY: sequence.rest_joints}
    )


def read(data: bytes) -> ForeignMotion:
    """Return the motion of a `.pt`; nothing in it is executed.

    Raises:
        BadTable: not such a file.
    """
    content = torch_archive.load(data, WHERE)
    if not isinstance(content.get(WORLD), dict):
        raise BadTable(f"{WHERE}: no dictionary {WORLD!r}. It has: {listed(content)}")
    part = content[WORLD]
    root, body = rows(part, "global_orient", 3, WHERE), rows(part, "body_pose", 63, WHERE)
    transl = rows(part, "transl", 3, WHERE)
    same_length(WHERE, global_orient=root, body_pose=body, transl=transl)
    return ForeignMotion(
        fps=number(content.get("fps")),
        rotations=matrices(np.concatenate([root, body], axis=1)),
        pelvis=transl + PELVIS["smplx"],
        rest_joints=skeleton_of(content),
        to_world=Y_UP_TO_WORLD.copy(),
        betas=betas_of(part),
    )


def _parameters(
    sequence: SmplSequence, turn: np.ndarray, origin: np.ndarray
) -> dict[str, np.ndarray]:
    """Return the parameters in axes that are turned about a world point."""
    root, pelvis = turned_root(sequence, turn)
    return {
        "body_pose": sequence.body_pose[:, :63],
        "global_orient": root,
        "transl": pelvis - turn @ origin - PELVIS["smplx"],
        "betas": np.tile(sequence.betas, (len(sequence), 1)),
    }


def _intrinsics(sequence: SmplSequence) -> np.ndarray:
    width, height, focal = (float(sequence.camera[k]) for k in ("width", "height", "focal_px"))  # type: ignore[arg-type]
    return np.array([[focal, 0.0, width / 2], [0.0, focal, height / 2], [0.0, 0.0, 1.0]])


EXPORT = PersonExporter("gvhmr", write)
IMPORT = Importer("gvhmr", read, lambda file: "data.pkl" in file.members, fps=FPS)
