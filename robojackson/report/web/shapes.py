"""Shapes of a robot and a person for a browser: solid parts of bodies, and their pose at each
moment.

Metres, quaternions wxyz, world frame; arrays are base64 of little-endian numbers.
"""

import base64
import copy

import mujoco
import numpy as np
from jaxtyping import Float

from robojackson.body.skeleton import KEYPOINT_NAMES, PARENTS
from robojackson.report.video.mesh_detail import simplify
from robojackson.report.video.robot_scene import shadowing

DETAIL_M = 0.009
"""Smallest detail of a mesh; a robot of 30 meshes then has some 40,000 triangles."""
ROUGH_M = 0.018
"""Smallest detail for shadows, and for browsers that draw on the processor."""
MESH_STEPS = 32767
"""Quantisation of a mesh's largest coordinate."""
RADII = {
    "hip": 0.085, "spine1": 0.105, "spine2": 0.11, "spine3": 0.115, "knee": 0.072, "ankle": 0.048,
    "foot": 0.042, "neck": 0.1, "head": 0.052, "collar": 0.075, "shoulder": 0.07, "elbow": 0.043,
    "wrist": 0.035, "hand": 0.032, "head_top": 0.1, "middle": 0.022, "big_toe": 0.032,
}  # fmt: skip
"""Radius of the part that ends at a keypoint, metres, by its name without the side."""


def packed(values: np.ndarray, kind: type[np.generic] = np.float32) -> str:
    """Return an array's numbers as base64."""
    return base64.b64encode(np.ascontiguousarray(values, kind).tobytes()).decode()


def robot_shape(model: mujoco.MjModel, detail_m: float = DETAIL_M) -> dict[str, object]:
    """Return the visible geoms of a robot by body; meshes with details of a given size."""
    small, coarse = copy.copy(model), copy.copy(model)
    simplify(small, detail_m)
    simplify(coarse, ROUGH_M)
    geoms, meshes = [], {}
    for geom in shadowing(model):
        kind = mujoco.mjtGeom(int(model.geom_type[geom])).name.removeprefix("mjGEOM_").lower()
        mesh = int(model.geom_dataid[geom])
        if kind == "mesh" and mesh not in meshes:
            meshes[mesh] = {**_mesh(small, mesh), "rough": _mesh(coarse, mesh)}
        geoms.append(
            {
                "body": int(model.geom_bodyid[geom]),
                "kind": kind,
                "size": model.geom_size[geom].round(5).tolist(),
                "pos": model.geom_pos[geom].round(5).tolist(),
                "quat": model.geom_quat[geom].round(6).tolist(),
                "mesh": mesh,
            }
        )
    return {"bodies": model.nbody, "geoms": geoms, "meshes": meshes}


def _mesh(model: mujoco.MjModel, mesh: int) -> dict[str, object]:
    """Return the corners that triangles use, quantised by the largest coordinate."""
    first = model.mesh_vertadr[mesh]
    faces = slice(model.mesh_faceadr[mesh], model.mesh_faceadr[mesh] + model.mesh_facenum[mesh])
    used, corners = np.unique(model.mesh_face[faces], return_inverse=True)
    vertices = model.mesh_vert[first + used]
    scale = float(np.abs(vertices).max()) / MESH_STEPS
    return {
        "scale": scale,
        "vertices": packed(np.round(vertices / scale), np.int16),
        "faces": packed(corners, np.uint16 if len(used) <= 1 << 16 else np.uint32),
        "wide": len(used) > 1 << 16,
    }


def body_poses(
    model: mujoco.MjModel, qpos: Float[np.ndarray, "N nq"]
) -> tuple[Float[np.ndarray, "N nbody 7"], Float[np.ndarray, "N nsite 3"]]:
    """Return the pose of every body and the positions of all sites, at every moment."""
    data = mujoco.MjData(model)
    poses, sites = np.zeros((len(qpos), model.nbody, 7)), np.zeros((len(qpos), model.nsite, 3))
    for index, row in enumerate(qpos):
        data.qpos[:] = row
        mujoco.mj_kinematics(model, data)
        poses[index, :, :3], poses[index, :, 3:] = data.xpos, data.xquat
        sites[index] = data.site_xpos
    return poses, sites


def person_shape() -> dict[str, object]:
    """Return the parts of a person between its keypoints: ends, radius and side."""
    bones = [
        {"from": parent, "to": child, "radius": RADII[bare(name)], "side": side_of(name)}
        for child, (parent, name) in enumerate(zip(PARENTS, KEYPOINT_NAMES, strict=True))
        if parent >= 0
    ]
    return {"points": len(KEYPOINT_NAMES), "bones": bones}


def bare(name: str) -> str:
    """Return a name without its side."""
    return name.removeprefix("left_").removeprefix("right_")


def side_of(name: str) -> str:
    """Return left, right or middle."""
    side = name.partition("_")[0]
    return side if side in ("left", "right") else "middle"
