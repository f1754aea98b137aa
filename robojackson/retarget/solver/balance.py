"""Lean: put the body over feet that are balls at the ankles.

A person stands with the centre of mass some centimetres in front of the ankles, and one camera
tilts whole bodies by degrees. A ball foot can balance neither. The median distance from the zero
moment point to the support, in the frame of the heading, is taken out by leaning the targets: each
point moves along the floor in proportion to its height. Metres.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float

from robojackson.motion.smpl_sequence import AIR
from robojackson.retarget.solver.clip_problem import Problem
from robojackson.retarget.targets.ground_contact import GRAVITY
from robojackson.retarget.targets.keypoint_targets import Targets
from robojackson.robot.tree_kinematics import Posed, centre_of_mass, pose


def moment_points(problem: Problem, posed: Posed) -> Float[np.ndarray, "N 2"]:
    """Return zero moment points of the linear inverted pendulum, c - h/g c''; ends repeat
    neighbours."""
    com, cycle_offset = centre_of_mass(problem.tree, posed), problem.targets.cycle_offset
    flat, height = com[:, :2], com[:, 2:].mean()
    if cycle_offset is None:
        inner = flat[1:-1] - height / GRAVITY * np.diff(flat, 2, axis=0) / problem.targets.dt**2
        return np.concatenate([inner[:1], inner, inner[-1:]])
    joined = np.concatenate([flat[-1:] - cycle_offset[:2], flat, flat[:1] + cycle_offset[:2]])
    result: np.ndarray = (
        flat - height / GRAVITY * np.diff(joined, 2, axis=0) / problem.targets.dt**2
    )
    return result


def lean(problem: Problem, qpos: Float[np.ndarray, "N nq"]) -> Float[np.ndarray, "2"]:
    """Return the forward and left shift at one metre of height that puts the body over its
    support."""
    posed = pose(problem.tree, qpos)
    feet = posed.ball_pos[..., :2]
    touching = problem.targets.contact != AIR
    point = moment_points(problem, posed)
    away = support(point, feet, touching).nearest - point
    carried = touching.any(axis=1)
    if not carried.any():
        return np.zeros(2)
    forward, left = _axes(problem.targets)
    local = np.stack([np.sum(away * forward, 1), np.sum(away * left, 1)], axis=1)[carried]
    height = centre_of_mass(problem.tree, posed)[:, 2].mean()
    return np.asarray(np.median(local, axis=0) / height)


def leaned(aims: Targets, shift: Float[np.ndarray, "2"]) -> Targets:
    """Return the targets moved along the floor by `shift` for each metre of their height."""
    forward, left = _axes(aims)
    move = shift[0] * forward + shift[1] * left
    keypoints = aims.keypoints_w.copy()
    keypoints[..., :2] += keypoints[..., 2:] * move[:, None]
    return replace(aims, keypoints_w=keypoints)


@dataclass(frozen=True)
class Support:
    """Support of the soles in contact.

    Attributes:
        nearest: The point of their convex hull next to a given point, which itself may be in it.
        weights: Shares of the contacts in the nearest point of the hull's border, zero in the air.
    """

    nearest: Float[np.ndarray, "N 2"]
    weights: Float[np.ndarray, "N C"]


def support(
    point: Float[np.ndarray, "N 2"],
    feet: Float[np.ndarray, "N C 2"],
    touching: Bool[np.ndarray, "N C"],
) -> Support:
    """Return the hull of the contacts; of two it is a segment, of one a point, of none nothing.

    The border is made of segments between contacts, and no segment between contacts leaves the
    hull: the nearest point of all segments is the nearest of the hull, unless the point is inside.
    """
    count = touching.shape[1]
    first, second = np.array([(i, j) for i in range(count) for j in range(i, count)]).T
    start, end = feet[:, first], feet[:, second]
    span = np.maximum(np.sum((end - start) ** 2, axis=2), 1e-6)
    along = np.sum((point[:, None] - start) * (end - start), axis=2) / span
    along = np.clip(along, 0.0, 1.0)
    border = start + along[..., None] * (end - start)
    far = np.sum((point[:, None] - border) ** 2, axis=2)
    far[~(touching[:, first] & touching[:, second])] = np.inf
    pick, row = far.argmin(axis=1), np.arange(len(point))
    carried = np.asarray(touching.any(axis=1))
    shares = np.zeros(touching.shape)
    np.add.at(shares, (row, first[pick]), (1 - along[row, pick]) * carried)
    np.add.at(shares, (row, second[pick]), along[row, pick] * carried)
    nearest = np.where(carried[:, None], border[row, pick], 0.0)
    beyond = np.einsum("nci,ni->nc", feet - nearest[:, None], point - nearest)
    inside = (touching & (beyond > 1e-9)).any(axis=1, keepdims=True)
    return Support(np.where(inside, point, nearest), shares)


def _axes(aims: Targets) -> tuple[np.ndarray, np.ndarray]:
    """Return the horizontal unit vectors forward and left of the trunk, (N, 2) each."""
    left = aims.heading[:, :2, 1]
    left = left / np.linalg.norm(left, axis=1, keepdims=True).clip(1e-6)
    return np.stack([left[:, 1], -left[:, 0]], axis=1), left
