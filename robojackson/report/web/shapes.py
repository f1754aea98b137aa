"""Shapes of a robot and a person for a browser: solid parts of bodies, and their pose at each
moment.

Metres, quaternions wxyz, world frame; arrays are base64 of little-endian numbers.
"""

import base64

import mujoco
import numpy as np
from jaxtyping import Float

from robojackson.body.skeleton import KEYPOINT_NAMES, PARENTS, part_radius, side_of
from robojackson.geometry.surface import shaded
from robojackson.robot.body_states import drawn_geoms

DETAIL_M = 0.009
"""Smallest detail of a mesh; a robot of 30 meshes then has some 40,000 triangles."""
ROUGH_M, SHADOW_M = 0.018, 0.06
"""The same for browsers that draw on the processor, and for shadows."""
MESH_STEPS, NORMAL_STEPS = 32767, 127
"""Steps of a mesh's largest coordinate, and of a normal's."""


def packed(values: np.ndarray, kind: type[np.generic] = np.float32) -> str:
    """Return an array's numbers as base64."""
    return base64.b64encode(np.ascontiguousarray(values, kind).tobytes()).decode()


def robot_shape(model: mujoco.MjModel, detail_m: float = DETAIL_M) -> dict[str, object]:
    """Return the visible geoms of a robot by body; meshes with details of a given size."""
    geoms, meshes = [], {}
    for geom in drawn_geoms(model):
        kind = mujoco.mjtGeom(int(model.geom_type[geom])).name.removeprefix("mjGEOM_").lower()
        mesh = int(model.geom_dataid[geom])
        if kind == "mesh" and mesh not in meshes:
            levels = {"rough": ROUGH_M, "shadow": SHADOW_M}
            coarse = {name: _mesh(model, mesh, cell_m) for name, cell_m in levels.items()}
            meshes[mesh] = _mesh(model, mesh, detail_m) | coarse
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


def _mesh(model: mujoco.MjModel, mesh: int, cell_m: float) -> dict[str, object]:
    """Return a mesh, its corners as steps of the largest coordinate."""
    first = model.mesh_vertadr[mesh]
    faces = slice(model.mesh_faceadr[mesh], model.mesh_faceadr[mesh] + model.mesh_facenum[mesh])
    vertices = model.mesh_vert[first : first + model.mesh_vertnum[mesh]]
    surface = shaded(vertices, model.mesh_face[faces], cell_m)
    scale = max(float(np.abs(surface.vertices).max(initial=0.0)), 1e-9) / MESH_STEPS
    wide = len(surface.vertices) > 1 << 16
    return {
        "scale": scale,
        "vertices": packed(np.round(surface.vertices / scale), np.int16),
        "normals": packed(np.round(surface.normals * NORMAL_STEPS), np.int8),
        "faces": packed(surface.faces, np.uint32 if wide else np.uint16),
        "wide": wide,
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
        {"from": parent, "to": child, "radius": part_radius(name), "side": side_of(name)}
        for child, (parent, name) in enumerate(zip(PARENTS, KEYPOINT_NAMES, strict=True))
        if parent >= 0
    ]
    return {"points": len(KEYPOINT_NAMES), "bones": bones}
