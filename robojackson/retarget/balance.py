"""Lean: bring the body over feet that are balls at the ankles.

A person stands with the centre of mass some centimetres in front of the ankles, and one camera
tilts whole bodies by degrees. A ball foot can balance neither. The median distance from the zero
moment point to the support, in the frame of the heading, is taken out by leaning the targets: each
point moves along the floor in proportion to its height. Metres.
"""

from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float

from robojackson.motion.smpl import AIR
from robojackson.retarget.contact import GRAVITY
from robojackson.retarget.kinematics import Posed, centre_of_mass, pose
from robojackson.retarget.problem import Problem
from robojackson.retarget.targets import Targets


def moment_points(problem: Problem, posed: Posed) -> Float[np.ndarray, "N 2"]:
    """Zero moment points of the linear inverted pendulum, c - h/g c''; ends repeat neighbours."""
    com, lap = centre_of_mass(problem.tree, posed), problem.targets.lap
    flat, height = com[:, :2], com[:, 2:].mean()
    if lap is None:
        inner = flat[1:-1] - height / GRAVITY * np.diff(flat, 2, axis=0) / problem.targets.dt**2
        return np.concatenate([inner[:1], inner, inner[-1:]])
    joined = np.concatenate([flat[-1:] - lap[:2], flat, flat[:1] + lap[:2]])
    return flat - height / GRAVITY * np.diff(joined, 2, axis=0) / problem.targets.dt**2


def lean(problem: Problem, qpos: Float[np.ndarray, "N nq"]) -> Float[np.ndarray, "2"]:
    """Forward and left shift at one metre of height that puts the body over its support."""
    posed = pose(problem.tree, qpos)
    feet = posed.site_pos[:, problem.robot.contact_keypoints, :2]
    touching = problem.targets.contact != AIR
    point = moment_points(problem, posed)
    away = np.einsum("nc,nci->ni", support_shares(point, feet, touching), feet) - point
    carried = touching.any(axis=1)
    if not carried.any():
        return np.zeros(2)
    forward, left = _axes(problem.targets)
    local = np.stack([np.sum(away * forward, 1), np.sum(away * left, 1)], axis=1)[carried]
    height = centre_of_mass(problem.tree, posed)[:, 2].mean()
    return np.asarray(np.median(local, axis=0) / height)


def leaned(aims: Targets, shift: Float[np.ndarray, "2"]) -> Targets:
    """Targets moved along the floor by `shift` for each metre of their height."""
    forward, left = _axes(aims)
    move = shift[0] * forward + shift[1] * left
    keypoints = aims.keypoints_w.copy()
    keypoints[..., :2] += keypoints[..., 2:] * move[:, None]
    return replace(aims, keypoints_w=keypoints)


def support_shares(
    point: Float[np.ndarray, "N 2"],
    feet: Float[np.ndarray, "N C 2"],
    touching: Bool[np.ndarray, "N C"],
) -> Float[np.ndarray, "N C"]:
    """Shares of the contacts in the nearest point of the segment between the outermost two."""
    out = np.zeros(touching.shape)
    frames = np.flatnonzero(touching.any(axis=1))
    if not len(frames):
        return out
    first = touching[frames].argmax(axis=1)
    last = touching.shape[1] - 1 - touching[frames, ::-1].argmax(axis=1)
    start, end = feet[frames, first], feet[frames, last]
    span = np.maximum(np.sum((end - start) ** 2, axis=1), 1e-6)
    along = np.clip(np.sum((point[frames] - start) * (end - start), axis=1) / span, 0.0, 1.0)
    np.add.at(out, (frames, first), 1 - along)
    np.add.at(out, (frames, last), along)
    return out


def _axes(aims: Targets) -> tuple[np.ndarray, np.ndarray]:
    """Horizontal unit vectors forward and left of the trunk, (N, 2) each."""
    left = aims.heading[:, :2, 1]
    left = left / np.linalg.norm(left, axis=1, keepdims=True).clip(1e-6)
    return np.stack([left[:, 1], -left[:, 0]], axis=1), left
