"""HybrIK's analytic solve: keypoints and twists to rotations (Li et al., CVPR 2021, section 3.3).

Down the tree, each joint swings its rest bone onto the target bone and turns it by its twist. NAIVE
aims along the predicted bone; ADAPTIVE aims from where the parent really ended, so that errors do
not add up along a limb. HybrIK adds 1e-8 to the denominators of a swing. Next to a half turn that
moves a bone, and with it all that hangs on it: NAIVE does the same, so that it gives HybrIK's
rotations; ADAPTIVE does not. Metres; any common frame of keypoints.
"""

from collections.abc import Callable
from typing import Literal

import numpy as np
from jaxtyping import Float

from robojackson.body.forward_kinematics import (
    TINY,
    apply,
    kabsch,
    rotate_about,
    swing,
    twist,
)
from robojackson.body.skeleton import AIM_CHILD, JOINT_NAMES, PARENTS, keypoint

Method = Literal["adaptive", "naive"]
TwistRule = Callable[[int, np.ndarray], np.ndarray]
"""(joint, global rotation with its swing and without its twist) -> (T, 2) cos and sin."""


def _levels() -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Return the joints 1..23 in groups that do not hang on one another."""
    depth = [0]
    for parent in PARENTS[1 : len(JOINT_NAMES)]:
        depth.append(depth[parent] + 1)
    groups = [np.flatnonzero(np.array(depth) == level) for level in range(1, max(depth) + 1)]
    return [(g, np.array(PARENTS)[g], np.array(AIM_CHILD)[g]) for g in groups]


CARRY_OVER_FULL, CARRY_OVER_NONE = 0.010, 0.030
"""Metres; an adaptive bone that differs less from the predicted one is corrected in full, one that
differs more not at all. HybrIK switches at 0.015, and everything that hangs on the bone jumps."""
SAFEGUARD = 1e-8
"""What HybrIK adds to denominators, products of two bones in square metres."""
LEVELS = _levels()
"""(joints, their parents, the children that they aim at) by distance from the pelvis."""
ROOT_CHILDREN = (keypoint("spine1"), keypoint("left_hip"), keypoint("right_hip"))


def solve(
    keypoints: Float[np.ndarray, "T 29 3"],
    rest_joints: Float[np.ndarray, "*T 29 3"],
    twist: Float[np.ndarray, "T 23 2"],
    method: Method = "adaptive",
) -> Float[np.ndarray, "T 24 3 3"]:
    """Return the local rotation matrices that pose `rest_joints` (T or 1 of them) onto the
    keypoints.

    Args:
        keypoints: Targets, metres, order of `KEYPOINT_NAMES`.
        rest_joints: The T-pose, metres.
        twist: (cos, sin) of joints 1..23 about their rest bones; need not have length one.
        method: adaptive or naive.
    """
    turns = np.broadcast_to(np.asarray(twist, float), (len(keypoints), 23, 2))
    return solve_with(keypoints, rest_joints, lambda joint, _: turns[:, joint - 1], method)


def solve_with(
    keypoints: Float[np.ndarray, "T 29 3"],
    rest_joints: Float[np.ndarray, "*T 29 3"],
    twist_rule: TwistRule,
    method: Method = "adaptive",
) -> Float[np.ndarray, "T 24 3 3"]:
    """Return the same as `solve`, with each twist decided when the joint's swing is known."""
    goal = np.asarray(keypoints, float)
    count = len(goal)
    rest = np.broadcast_to(np.asarray(rest_joints, float), (count, 29, 3))
    local = np.empty((count, 24, 3, 3))
    world = np.empty((count, 24, 3, 3))
    position = np.empty((count, 24, 3))
    local[:, 0] = world[:, 0] = _root(goal, rest, method)
    position[:, 0] = goal[:, 0]
    for joints, parents, children in LEVELS:
        above = world[:, parents]
        ends = position[:, parents] + apply(above, rest[:, joints] - rest[:, parents])
        bone = rest[:, children] - rest[:, joints]
        target = _target_directions(goal[:, children], goal[:, joints], ends, bone, method)
        swung = _swing(bone, apply(np.swapaxes(above, -1, -2), target), method)
        ahead = above @ swung
        turns = [twist_rule(int(joint), ahead[:, k]) for k, joint in enumerate(joints)]
        turn = twist(bone, np.stack(turns, 1))
        position[:, joints] = ends
        local[:, joints] = swung @ turn
        world[:, joints] = ahead @ turn
    return local


def _target_directions(
    child: np.ndarray, start: np.ndarray, end: np.ndarray, bone: np.ndarray, method: Method
) -> np.ndarray:
    """Return the direction along which the bones of some joints should point.

    Args:
        child: Where the bones should end.
        start: Points at which they should begin.
        end: Where their parents really end.
        bone: Bone in the rest pose.
        method: naive or adaptive.
    """
    predicted = child - start
    if method == "naive":
        result_: np.ndarray = predicted
        return result_
    length = np.linalg.norm(predicted, axis=-1, keepdims=True)
    rescaled = predicted * np.linalg.norm(bone, axis=-1, keepdims=True) / np.maximum(length, TINY)
    corrected = child - end
    off = np.linalg.norm(corrected - rescaled, axis=-1, keepdims=True)
    share = np.clip((off - CARRY_OVER_FULL) / (CARRY_OVER_NONE - CARRY_OVER_FULL), 0.0, 1.0)
    kept = 1.0 - share**2 * (3.0 - 2.0 * share)
    result: np.ndarray = rescaled + kept * (corrected - rescaled)
    return result


def _root(goal: np.ndarray, rest: np.ndarray, method: Method) -> np.ndarray:
    children = list(ROOT_CHILDREN)
    bones = rest[:, children] - rest[:, :1]
    target = goal[:, children] - goal[:, :1]
    if method == "adaptive":
        return kabsch(bones, target)
    swung = _swing(bones[:, 0], target[:, 0], method)
    spine = target[:, 0]
    axis = spine / (np.linalg.norm(spine, axis=-1, keepdims=True) + SAFEGUARD)
    before = _across(apply(swung, bones[:, 1:].mean(1)), axis)
    after = _across(target[:, 1:].mean(1), axis)
    result: np.ndarray = _swing(before, after, method) @ swung
    return result


def _swing(start: np.ndarray, end: np.ndarray, method: Method) -> np.ndarray:
    """Return the shortest rotation from one direction to another.

    With HybrIK's safeguard it is a little less than a rotation next to a half turn; at exactly half
    a turn it is none at all.
    """
    if method == "adaptive":
        return swing(start, end)
    start, end = np.broadcast_arrays(start, end)
    normal = np.cross(start, end)
    sine = np.linalg.norm(normal, axis=-1)
    size = np.linalg.norm(start, axis=-1) * np.linalg.norm(end, axis=-1) + SAFEGUARD
    axis = normal / (sine + SAFEGUARD)[..., None]
    turned: np.ndarray = rotate_about(axis, np.sum(start * end, -1) / size, sine / size)
    return turned


def _across(vector: np.ndarray, axis: np.ndarray) -> np.ndarray:
    """Return the part of a vector at right angles to a unit axis."""
    result: np.ndarray = vector - np.sum(vector * axis, -1, keepdims=True) * axis
    return result
