"""What the policy sees: the robot in its own frame, the next reference step, and the difference.

Metres, radians, seconds, scaled by fixed constants to about one and clipped to +-10. Vectors are
in the frame of the root body, so a policy knows nothing of where north is, except through the
difference to its reference.
"""

import numpy as np
from jaxtyping import Float

from robojackson.geometry.rotations import quat_to_matrix
from robojackson.rl.sim.reference_clip import ClipStep

SPEED_SCALE, HINGE_SPEED_SCALE, POINT_SCALE, ROOT_SCALE, CLIP = 0.3, 0.1, 2.0, 3.0, 10.0


def observe(
    qpos: Float[np.ndarray, "N nq"],
    qvel: Float[np.ndarray, "N nv"],
    points: Float[np.ndarray, "N K 3"],
    target: ClipStep,
    last_action: Float[np.ndarray, "N nu"],
) -> Float[np.ndarray, "N D"]:
    """Observation of N robots whose next reference step is `target`, float32."""
    turned, wanted = quat_to_matrix(np.stack([qpos[:, 3:7], target.qpos[:, 3:7]]))
    to_body = np.swapaxes(turned, 1, 2)
    turn = to_body @ wanted

    def local(vector: np.ndarray) -> np.ndarray:
        found: np.ndarray = np.einsum("nij,nj->ni", to_body, vector)
        return found

    angle = 2 * np.pi * target.phase
    parts = [
        qpos[:, 2:3] - 1.2,
        to_body[:, :, 2],
        local(qvel[:, :3]),
        qvel[:, 3:6] * SPEED_SCALE,
        qpos[:, 7:],
        qvel[:, 6:] * HINGE_SPEED_SCALE,
        np.stack([np.sin(angle), np.cos(angle)], 1),
        local(target.qpos[:, :3] - qpos[:, :3]) * ROOT_SCALE,
        turn[:, :, 0],
        turn[:, :, 1],
        target.qpos[:, 7:] - qpos[:, 7:],
        target.qvel[:, 6:] * HINGE_SPEED_SCALE,
        local(target.qvel[:, :3]),
        ((target.points - points) @ np.swapaxes(to_body, 1, 2)).reshape(len(qpos), -1)
        * POINT_SCALE,
        last_action * 0.5,
    ]
    result: np.ndarray = np.clip(np.concatenate(parts, 1), -CLIP, CLIP).astype(np.float32)
    return result


def observation_size(hinges: int, motors: int, points: int) -> int:
    """Length of the observation of a robot with that many hinges, motors and points."""
    return 24 + 4 * hinges + motors + 3 * points
