"""Starts of the whole-clip solver: the rest pose, and inverse kinematics of every frame by itself.

The second solves each frame from several poses at once and picks one a frame so that the picks make
the smoothest cheap motion (Viterbi); its keypoint error is the kinematic floor of the clip.
"""

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from robojackson.geometry.rotations import from_rotation
from robojackson.retarget.banded import Normal
from robojackson.retarget.kinematics import continuous, integrate, pose
from robojackson.retarget.problem import Problem
from robojackson.retarget.solver import clip_to_limits, free_unknowns
from robojackson.retarget.terms import keypoint_normal

_ITERATIONS = 15
_JUMP_COST = 0.02  # m2/rad2: price of a hinge change between frames beside keypoint errors


def rest_start(problem: Problem) -> Float[np.ndarray, "N nq"]:
    """The rest pose in every frame, turned to the trunk and hung at the hip target."""
    robot, targets = problem.robot, problem.targets
    qpos = np.tile(robot.standing, (len(targets), 1))
    qpos[:, 3:7] = from_rotation(Rotation.from_matrix(targets.heading))
    hips = pose(problem.tree, qpos).site_pos[:, robot.keypoint_names.index("pelvis")]
    qpos[:, :3] += targets.keypoints_w[:, robot.keypoint_names.index("pelvis")] - hips
    return continuous(qpos)


def frame_start(problem: Problem, rng: np.random.Generator, seeds: int) -> np.ndarray:
    """Best of several per-frame solutions, chosen along the clip."""
    rest = rest_start(problem)
    solved, costs = [], []
    for seed in range(seeds):
        start = rest.copy()
        if seed:
            spread = problem.robot.upper - problem.robot.lower
            start[:, 7:] += 0.5 * spread * rng.uniform(-1, 1, len(spread))
        qpos, cost = _per_frame(problem, start)
        solved.append(qpos)
        costs.append(cost)
    pick = _viterbi(np.stack(costs, 1), np.stack(solved, 1)[..., 7:])
    return continuous(np.stack(solved, 1)[np.arange(len(rest)), pick])


def _per_frame(problem: Problem, start: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Damped Gauss-Newton on keypoints and posture, all frames at once, without coupling."""
    qpos, weight = clip_to_limits(problem.robot, start), problem.weights.posture
    frames, unknowns = len(qpos), qpos.shape[1] - 1
    damping = np.concatenate([np.full(6, 1e-4), np.full(unknowns - 6, weight + 3e-3)])
    for _ in range(_ITERATIONS):
        normal = Normal.empty(frames, unknowns)
        keypoint_normal(problem, pose(problem.tree, qpos), normal)
        normal.gradient[:, 6:] += weight * (qpos[:, 7:] - problem.robot.rest)
        free = free_unknowns(problem.robot, qpos, normal.gradient)
        matrix = normal.blocks[0] * (free[:, :, None] & free[:, None, :]) + np.diag(damping)
        step = -np.linalg.solve(matrix, (normal.gradient * free)[..., None])[..., 0]
        step *= np.minimum(1.0, 0.7 / np.abs(step[:, 3:]).max(axis=1, keepdims=True).clip(1e-9))
        qpos = clip_to_limits(problem.robot, integrate(qpos, step))
    cost = keypoint_normal(problem, pose(problem.tree, qpos), Normal.empty(frames, unknowns))
    return qpos, cost


def _viterbi(cost: Float[np.ndarray, "N M"], hinges: Float[np.ndarray, "N M J"]) -> np.ndarray:
    """Index of the candidate of each frame on the cheapest path."""
    best, back = cost[0].copy(), np.zeros(cost.shape, int)
    for t in range(1, len(cost)):
        jump = np.sum((hinges[t - 1][:, None] - hinges[t][None]) ** 2, axis=-1)
        total = best[:, None] + _JUMP_COST * jump
        back[t] = total.argmin(axis=0)
        best = total.min(axis=0) + cost[t]
    path = np.zeros(len(cost), int)
    path[-1] = best.argmin()
    for t in range(len(cost) - 1, 0, -1):
        path[t - 1] = back[t][path[t]]
    return path
