"""The preview: the reference ahead as a policy sees it; it replaces the phase of a general tracker.

For every step and every time ahead, in the heading frame of the reference's root at that step: the
root's displacement (m), its turn (sine, cosine) and height (m), the up axis in its own frame, and
the hinges' offsets from the stand (rad). It does not depend on the robot's state, so it is computed
once.
"""

import numpy as np
from jaxtyping import Float

from robojackson.geometry.rotations import heading, quat_to_matrix
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.rl.sim.reference_clip import Clip
from robojackson.robot.model import Robot

AHEAD_S = (0.1, 0.2, 0.4, 0.7)
ROOT_NUMBERS = 9
"""Numbers of the root, for a time ahead: displacement 3, turn 2, height 1, up 3."""
DISTANCE_SCALE = 3.0


def preview_size(hinges: int) -> int:
    """Return the length of a preview of a robot with `hinges` hinges."""
    return len(AHEAD_S) * (ROOT_NUMBERS + hinges)


def preview_of(reference: ReferenceMotion, robot: Robot) -> Float[np.ndarray, "S P"]:
    """Return the preview of every step of a reference motion."""
    clip, now = Clip(reference), np.arange(len(reference))
    here = clip.at(now)
    yaw = np.asarray(heading(here.qpos[:, 3:7]))
    parts: list[np.ndarray] = []
    for seconds in AHEAD_S:
        there = clip.at(now + round(seconds / reference.dt))
        moved = there.qpos[:, :2] - here.qpos[:, :2]
        cos, sin = np.cos(yaw), np.sin(yaw)
        ahead = np.stack([cos * moved[:, 0] + sin * moved[:, 1],
                          cos * moved[:, 1] - sin * moved[:, 0]], 1)  # fmt: skip
        turn = np.asarray(heading(there.qpos[:, 3:7])) - yaw
        rise = there.qpos[:, 2:3] - here.qpos[:, 2:3]
        height = there.qpos[:, 2:3] - robot.standing[2]
        up = quat_to_matrix(there.qpos[:, 3:7])[:, 2, :]
        angles = there.qpos[:, 7:] - robot.standing[7:]
        scaled = DISTANCE_SCALE * np.concatenate([ahead, rise, height], 1)
        parts += [scaled, np.sin(turn)[:, None], np.cos(turn)[:, None], up, angles]
    return np.concatenate(parts, 1)
