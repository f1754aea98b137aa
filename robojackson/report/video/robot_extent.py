"""The space that a robot takes: corners of the boxes around its parts, world, metres."""

import mujoco
import numpy as np
from jaxtyping import Float, Int

from robojackson.report.video.robot_scene import SHADOW_REACH
from robojackson.robot.body_states import drawn_geoms

SIGNS = np.array(np.meshgrid(*[(-1.0, 1.0)] * 3)).reshape(3, -1).T


def corners(
    model: mujoco.MjModel, data: mujoco.MjData, geoms: Int[np.ndarray, " G"]
) -> Float[np.ndarray, "G 8 3"]:
    """Return the corners of the boxes around geoms, in the pose of `data`."""
    middle, half = model.geom_aabb[geoms, None, :3], model.geom_aabb[geoms, None, 3:]
    turn = data.geom_xmat[geoms].reshape(-1, 3, 3)
    local = middle + SIGNS * half
    result: np.ndarray = data.geom_xpos[geoms, None] + local @ turn.transpose(0, 2, 1)
    return result


def room_of(
    model: mujoco.MjModel,
    qpos: Float[np.ndarray, "N nq"],
    targets: Float[np.ndarray, "N 2"],
) -> Float[np.ndarray, "M 3"]:
    """Return the corners of a robot and its shadows in every pose, from where the camera looks."""
    data, geoms = mujoco.MjData(model), drawn_geoms(model)
    reach = SHADOW_REACH * model.geom_rbound[geoms, None, None] * SIGNS[:4, :2]
    found = []
    for pose, target in zip(qpos, targets, strict=True):
        data.qpos[:] = pose
        mujoco.mj_kinematics(model, data)
        discs = np.zeros((len(geoms), 4, 3))
        discs[..., :2] = data.geom_xpos[geoms, None, :2] + reach
        points = np.concatenate([corners(model, data, geoms), discs], 1).reshape(-1, 3)
        found.append(points - [*target, 0.0])
    return np.concatenate(found)
